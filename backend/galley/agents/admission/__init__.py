"""How an agent from elsewhere is let in: converted, tried, measured, and described on its card."""
