"""Rehearsal: a program on sampled real cells, corrected pass by pass."""
