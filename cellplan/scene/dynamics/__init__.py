"""Torques and reactions of robots with known masses, and loads on their flanges."""
