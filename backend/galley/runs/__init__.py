"""Long work: the folder of a run, where it came from, and going on where it stopped."""
