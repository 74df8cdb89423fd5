"""Variables of a layout search: from the cell file to the kernel, and back."""
