"""URDF: document, tree, limits, bodies."""
