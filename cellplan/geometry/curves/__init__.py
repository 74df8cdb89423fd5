"""Curves: splines, arc length, patches of surfaces, orientations along a curve."""
