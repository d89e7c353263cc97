"""Who thinks ahead: distances in a kitchen and the myopic human."""
