"""What happened, read again: overviews, flags, timelines, replays and their verification."""
