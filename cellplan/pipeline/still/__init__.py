"""The picture of the instant that decides the verdict of a run."""
