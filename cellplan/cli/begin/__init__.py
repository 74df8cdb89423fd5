"""Commands to begin with: templates, robots, and what a cell says before anything is solved."""
