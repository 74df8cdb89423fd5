"""Commands that improve a cell or a program: searches, maps, sweeps, comparisons."""
