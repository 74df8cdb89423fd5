"""Commands for the real cell: rehearsal and recovery."""
