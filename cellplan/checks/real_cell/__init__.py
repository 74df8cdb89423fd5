"""Checks of a rehearsed cell: true errors, execution, figures of ISO 9283."""
