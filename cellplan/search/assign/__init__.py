"""Assignment: which robot does which task, in which block, at which pose of the part, and how."""
