"""Contact verdicts and distances that are never above the truth."""
