"""Figures of results and runs, made with matplotlib without its global state."""
