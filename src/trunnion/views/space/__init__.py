"""Views of spatial mechanisms."""
