"""The cooperation Jacobian derived in three ways that share no formula: Denavit-Hartenberg, screws, Davies' method."""
