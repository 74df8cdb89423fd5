"""Drawings of a run: the picture of the instant that decides its verdict, and its floor plan."""
