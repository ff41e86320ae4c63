"""What tolerances to buy: the least cost that keeps the limits of measures."""
