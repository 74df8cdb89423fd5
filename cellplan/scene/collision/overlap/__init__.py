"""Overlap of solids: containment, depth, zones in which contact is meant."""
