"""Verification of written tables, by arithmetic independent of planning."""
