"""Jobs of Yaskawa controllers in INFORM (.JBI): lines and arcs in a user frame, writer and reader."""
