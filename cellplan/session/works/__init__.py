"""Heavy work of a session, each kind in a file and a function of its name, done by worker processes."""
