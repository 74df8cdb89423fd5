"""Motions: joint positions over time, phases and plans of a program."""
