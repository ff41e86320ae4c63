"""Every number of a result that a study can ask for, by name, unit and place."""
