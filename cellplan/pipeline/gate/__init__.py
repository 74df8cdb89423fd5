"""The gate: a run folder is opened for export only after it is verified from its own files."""
