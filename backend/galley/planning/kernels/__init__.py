"""The compiled halves of the planners: searches, estimates and decisions on plain arrays."""
