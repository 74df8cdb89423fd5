"""Sequences: the stages of a program from home to home."""
