"""The command line, one file per noun; each command imports what it needs only when it runs."""
