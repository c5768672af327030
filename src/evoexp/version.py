"""The version of evoexp."""

__version__ = "0.2.0"
