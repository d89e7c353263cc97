"""Simulated participants: they open the pages of a server, fill in its forms and play its rounds."""
