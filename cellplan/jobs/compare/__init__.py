"""One cell in every mode, or several cells and runs, side by side."""
