"""Robots: bundled joint tables, joint tables of the user, URDF."""
