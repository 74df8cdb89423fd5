"""The accurate mode: joints as polynomials in time, found at all nodes of a stretch of time at once."""
