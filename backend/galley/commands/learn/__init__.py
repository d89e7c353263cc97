"""`galley learn`: agents made from data and by training (extra `learn`), judged, and drawn (extra `plot`)."""
