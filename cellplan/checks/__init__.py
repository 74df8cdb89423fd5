"""Verification of what was written, by arithmetic that planning never used."""
