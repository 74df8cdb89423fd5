"""The motion of many candidate layouts at once, and its exact derivatives."""
