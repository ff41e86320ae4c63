"""Joints as built: pairs and friction laws."""
