"""Triangle meshes: files, topology, rays."""
