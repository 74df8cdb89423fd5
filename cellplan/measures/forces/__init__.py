"""Static forces over the rows of a run: wrenches of processes and weights, and how robots balance them."""
