"""Records as files: sheets, their formats and the data dictionary."""
