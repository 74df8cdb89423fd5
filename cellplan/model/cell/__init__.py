"""Cells: robots, what surrounds them, and what is demanded of them."""
