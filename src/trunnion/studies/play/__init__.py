"""What the play of joints does to measures."""
