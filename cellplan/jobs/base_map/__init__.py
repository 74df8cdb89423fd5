"""Maps of a base: the whole job of a cell with one robot at every place of a grid."""
