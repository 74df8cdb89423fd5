"""Numbers only: poses, shapes, curves, surfaces and meshes."""
