"""Cycle times: the shortest ones of a cell, what calmer ones load the joints with, and the one that meets a demand."""
