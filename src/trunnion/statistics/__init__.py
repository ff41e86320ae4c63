"""Random numbers, their statistics, and what a tolerance costs: on plain numbers, without a model."""
