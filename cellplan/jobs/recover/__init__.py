"""Recovery: retract-and-home joint tables from where a cell has stopped."""
