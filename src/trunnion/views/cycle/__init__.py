"""Views of a cycle: drawing, curves, report."""
