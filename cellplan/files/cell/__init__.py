"""Cell files: read, checked, converted to the model and written."""
