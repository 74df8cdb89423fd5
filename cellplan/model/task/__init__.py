"""Tasks: what tools do on the part, and when."""
