"""Plots of runs and rehearsals."""
