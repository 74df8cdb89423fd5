"""The cooperation Jacobian in three more derivations."""
