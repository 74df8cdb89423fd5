"""Files: cells, robots, meshes and toolpaths in; tables and folders out."""
