"""Proximal policy optimisation: the policy network, rollouts and one update."""
