"""What the engineer states: the mechanism, its quantities, its file, and the checks of them."""
