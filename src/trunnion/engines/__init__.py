"""How a kernel is run beside NumPy: recorded as a graph, and compiled."""
