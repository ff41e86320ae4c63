"""How the figures of a cycle change with numbers of the mechanism."""
