"""The participant's pages and the way through a visit."""
