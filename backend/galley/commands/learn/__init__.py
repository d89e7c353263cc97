"""`galley learn`: agents made from data (needs the extra `learn`)."""
