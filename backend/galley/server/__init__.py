"""While it happens: pages, the play socket, live rounds and their clock."""
