"""Settings as files write them: frozen entries with units and bounds, which are the model where nothing is resolved."""
