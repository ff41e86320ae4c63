"""Views of an allocation."""
