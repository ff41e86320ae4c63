"""Views of what tolerances do."""
