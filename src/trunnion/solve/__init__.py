"""Positions: a mechanism made ready, motion forward through its modules, forces back, friction settled in each."""
