"""Mesh files read into loose triangles: STL, OBJ, PLY and COLLADA."""
