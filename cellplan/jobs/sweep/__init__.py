"""Sweeps: a cell solved with every combination of some values."""
