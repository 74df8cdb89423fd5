"""Repair of a failing cell: the smallest change with which it passes every check, and other remedies."""
