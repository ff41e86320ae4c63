"""Questions about many mechanisms, or about the choice of one: sweep, play, assembly, design, tolerance, allocation."""
