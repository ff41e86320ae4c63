"""Views of the ways in which a mechanism can be assembled, and of whether it can."""
