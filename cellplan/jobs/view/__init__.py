"""3-D pages: a run, a cell that was not solved, or the best layouts of a search, as one file for a browser."""
