"""Floor plan of a cell to scale, from above: as SVG text and as a DXF drawing."""
