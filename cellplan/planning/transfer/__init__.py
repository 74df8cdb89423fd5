"""Transfer moves between two configurations at rest: straight, in turn, or in joint space and time."""
