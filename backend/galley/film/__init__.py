"""Films of rounds: the kitchen as participants see it, as GIF or MP4. Needs the extra `video`."""
