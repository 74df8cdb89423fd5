"""The cell made computable: kinematic chains and collision bodies, built once."""
