"""Behaviour cloning: networks that predict what people did, and their bundles."""
