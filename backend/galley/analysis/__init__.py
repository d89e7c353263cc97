"""What it means (extra `report`): from the sheets of a study to its results."""
