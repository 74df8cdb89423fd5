"""One wide table of all robots: writer and columns."""
