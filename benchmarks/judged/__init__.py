"""What is right about a result, told from its published numbers and the model's data alone."""
