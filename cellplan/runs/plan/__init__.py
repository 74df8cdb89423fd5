"""One run planned: start, homes of idle robots, motion."""
