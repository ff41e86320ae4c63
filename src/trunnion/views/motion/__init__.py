"""Views of a motion in time."""
