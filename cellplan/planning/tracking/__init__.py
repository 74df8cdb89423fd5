"""Tracking: desired poses and twists, cooperation Jacobian, weighted inverse."""
