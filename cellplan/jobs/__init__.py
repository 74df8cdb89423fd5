"""Jobs over whole runs: repair, layout, rehearsal, comparison; each stands beside what is shown of its result."""
