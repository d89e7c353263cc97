"""Files that people and programs write: read with their lines, told what is wrong, written whole, locked."""
