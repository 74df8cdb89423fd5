"""Splines of joints that are improved: the path of a positioner that operators follow, and motion in the null space."""
