"""Verification of run folders before export, from their own files."""
