"""Checks of tools: tracking, closure, speeds, errors between rows, conditioning."""
