"""What the mechanics is computed with: dual numbers, their functions, small solves."""
