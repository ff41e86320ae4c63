"""The computer side of a test rig: what its sensors would show, and the model beside what they did show."""
