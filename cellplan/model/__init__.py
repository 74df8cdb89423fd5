"""Frozen data: what every stage takes and returns. SI units and radians throughout."""
