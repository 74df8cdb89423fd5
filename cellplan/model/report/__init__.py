"""Results: verified statements, and runs that were verified."""
