"""Rows of programs: on the cycle of a controller, thinned, on the part, and as their targets play them."""
