"""From a cell to a motion: toolpaths, schedule, start postures, cooperation Jacobian, integration."""
