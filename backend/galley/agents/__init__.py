"""Who acts: the agent protocol, scripted and network agents, bundles, and games between them."""
