"""Reading of files that users name: allowed folders, sizes, JSON, findings."""
