"""Elements of all program formats: numbers, names, clocks, corners and handshakes."""
