"""KRL of KUKA controllers: writer, names and reader."""
