"""Methods that make partners: self-play and those that train with a population."""
