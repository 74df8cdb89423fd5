"""STEP files: solids, faces and edges of parts with their names, as meshes and as lines along exact curves."""
