"""Whole jobs, each a short recipe over the stages."""
