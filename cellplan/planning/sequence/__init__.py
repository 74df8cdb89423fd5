"""Sequences of tasks: which are worked on together, and in which order."""
