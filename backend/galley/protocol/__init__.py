"""What travels between browser and round: messages, scenes and keyframes."""
