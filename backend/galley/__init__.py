"""Human-AI experiments in the shared kitchen of Overcooked."""

__version__ = "0.1.0"
