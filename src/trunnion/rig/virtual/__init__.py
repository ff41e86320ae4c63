"""A test rig that does not exist yet: what its sensors would show."""
