"""Random mechanisms, drawn from a seed as plain model data."""
