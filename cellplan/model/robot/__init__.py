"""Robots: joints, bodies, controllers and loads."""
