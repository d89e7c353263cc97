"""How well agents cook with each other and with strangers: bundles played, kept, put into tables."""
