"""Records: what a report holds, as data."""
