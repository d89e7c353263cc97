"""Where they cook (extra `design`): kitchens and floor plans that are searched for, not drawn."""
