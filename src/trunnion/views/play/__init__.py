"""Views of what play does."""
