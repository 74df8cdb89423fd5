"""Distances of a layout search: what stands too near in a candidate, and how that changes with its variables."""
