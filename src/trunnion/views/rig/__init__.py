"""Views of measured data."""
