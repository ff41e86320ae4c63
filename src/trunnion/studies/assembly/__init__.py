"""Whether an over-constrained mechanism goes together as it is built."""
