"""Seams: lines and arcs of a tool in a frame of the part, chosen from a run, and as controllers execute them."""
