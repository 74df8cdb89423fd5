"""Setpoints at the cycle of a controller: writer and record."""
