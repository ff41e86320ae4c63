"""Tolerances: what a mechanism whose numbers vary does, sample by sample, and which limits cost least."""
