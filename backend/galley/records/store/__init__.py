"""What the server writes and reads while studies run: visits, rounds, pairs and researchers."""
