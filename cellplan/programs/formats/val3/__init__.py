"""VAL3 of Stäubli controllers: writer and reader."""
