"""Checks of bodies: certified clearance, contacts, mounted bodies, depth of tools."""
