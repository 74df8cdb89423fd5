"""What programs promise: what holds when controllers play them, orders at marks, allowed skew."""
