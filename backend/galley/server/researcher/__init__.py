"""The researcher's pages: behind a login, under /researcher."""
