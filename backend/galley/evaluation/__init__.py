"""How well agents cook together: teams, cross-play, tables and the game graph. No PyTorch."""
