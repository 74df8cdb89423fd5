"""What several test files build: arms, cells, paths, runs, damage."""
