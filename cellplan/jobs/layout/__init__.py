"""Layout searches: from a cell and what may change in it to the best layout that passes every check."""
