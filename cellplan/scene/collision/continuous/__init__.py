"""Continuous collision: bounds on the distance of two bodies while they move."""
