"""Views of an identification."""
