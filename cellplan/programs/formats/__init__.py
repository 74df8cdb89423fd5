"""Program formats: one file or folder each, with a writer and a reader of its own."""
