"""Frozen data types that every stage takes and returns. SI units and radians throughout."""
