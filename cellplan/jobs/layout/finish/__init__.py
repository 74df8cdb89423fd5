"""The finish of a layout search: solved, verified and improved until every check passes."""
