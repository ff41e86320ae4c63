"""What is wrong with the plain fields of a model file."""
