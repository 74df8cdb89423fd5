"""Sections of the record of a run, one subject each."""
