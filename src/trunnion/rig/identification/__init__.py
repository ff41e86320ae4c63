"""Numbers of the model from measurements: estimates, how far they may be off, and what the data cannot tell."""
