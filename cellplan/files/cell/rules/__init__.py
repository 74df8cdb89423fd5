"""Rules between the entries of a cell file."""
