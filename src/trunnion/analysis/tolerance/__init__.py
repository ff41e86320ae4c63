"""Tolerances: what matters, what yields, what to buy."""
