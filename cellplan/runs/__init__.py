"""Runs: solved, written, opened again and verified."""
