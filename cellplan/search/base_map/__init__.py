"""Base maps: what becomes of the whole job when the base of one robot stands elsewhere in the plane."""
