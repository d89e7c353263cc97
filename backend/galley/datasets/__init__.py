"""What others recorded: human games of the field, read without running anything that their files name."""
