"""Tolerances: what a tolerated mechanism does, sample by sample, on one core or many."""
