"""Schedules of an assignment: blocks, their order, modes and transfers."""
