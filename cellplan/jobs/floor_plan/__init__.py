"""Floor plans of cells and runs: drawings and sheets of frames as files."""
