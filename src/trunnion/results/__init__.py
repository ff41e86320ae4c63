"""Results: their variables, declared once, and how they are written to files."""
