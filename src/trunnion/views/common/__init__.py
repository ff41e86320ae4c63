"""What all views share: one look, letters, numbers, scripts."""
