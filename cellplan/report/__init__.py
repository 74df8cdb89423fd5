"""The report as JSON, as one HTML page and as plots."""
