"""Euler steps along the clock with error feedback."""
