"""Results as pandas frames, and as what a notebook shows."""
