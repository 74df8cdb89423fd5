"""Distances of robots whose clocks are independent."""
