"""Assignments: who does which task, in which order, at which pose of the part."""
