"""The version of Trunnion."""

__version__ = "0.1.0"
