"""``--watch``: commands that begin again whenever a file is saved."""
