"""Trials of a layout search: from a cell that may change to a local optimum."""
