"""Recovery: from where a cell has stopped straight off the part, or back along the verified path."""
