"""Studies: many variants of one cell, each tried once, recorded line by line and continued after an interruption."""
