"""Timing: toolpaths on the common clock."""
