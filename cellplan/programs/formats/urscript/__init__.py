"""URScript of Universal Robots: writer and reader."""
