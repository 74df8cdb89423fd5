"""Checks of joints: limits, locks, drift, accelerations, loads."""
