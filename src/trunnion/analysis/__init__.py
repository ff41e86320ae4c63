"""One question each about a mechanism."""
