"""``cellplan edit``: the live cell in a browser, served on the loopback address to whoever has its token."""
