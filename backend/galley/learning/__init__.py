"""Who learns (extra `learn`): agents made from data with PyTorch; only the command line imports this."""
