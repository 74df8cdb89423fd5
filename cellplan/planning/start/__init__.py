"""Start: configurations from which all tasks can be carried out."""
