"""Commands from a cell to programs: solved, shown, verified, exported."""
