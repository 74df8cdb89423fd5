"""Controller programs: one file per format, each made from a verified run and read back by a reader of its own."""
