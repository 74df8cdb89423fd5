"""Paths: from a task's entries to poses of the tool on the part, before any robot or clock."""
