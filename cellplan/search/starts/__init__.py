"""Starts: where a search for a layout begins."""
