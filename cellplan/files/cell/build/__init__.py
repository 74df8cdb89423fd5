"""Entries of a cell file become the model."""
