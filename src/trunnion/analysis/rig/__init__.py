"""The computer side of a test rig: a model observed, compared with measurements, and identified from them."""
