"""Edges, seams and faces of a STEP file: as lines, as a record, as tasks to paste, and on a 3-D page."""
