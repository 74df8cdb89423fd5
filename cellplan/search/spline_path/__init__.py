"""The path of a positioner as a spline that is improved: operators at all nodes at once, and exact derivatives."""
