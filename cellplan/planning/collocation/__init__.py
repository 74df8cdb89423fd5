"""Collocation: joint polynomials that hold the tasks between samples too."""
