"""Streams of the program: results and errors, progress, what a terminal shows."""
