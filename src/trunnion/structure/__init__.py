"""How a mechanism is built: its mobility and its modules."""
