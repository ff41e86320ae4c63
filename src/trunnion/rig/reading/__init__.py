"""Measured data: files of a test rig, read by a mapping, checked, brought to positions of the cycle and averaged."""
