"""The live cell: changes of values in, answers about the whole job out; it knows neither HTTP nor HTML."""
