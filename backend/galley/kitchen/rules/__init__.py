"""The rules of a tick, one module a rule set."""
