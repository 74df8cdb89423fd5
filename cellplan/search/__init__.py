"""Search of layouts and whole paths: what moves when bases, tools, start postures and weights change."""
