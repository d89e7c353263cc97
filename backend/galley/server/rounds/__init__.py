"""Live rounds: matches, their clock, sockets, agents and take-over."""
