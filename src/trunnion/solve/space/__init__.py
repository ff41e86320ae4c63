"""The analysis in space: what differs from the plane."""
