"""Progress of long stages, reported to whoever listens."""

from collections.abc import Callable

Progress = Callable[[str, float], None]  # (what is being done, share done 0..1)


def silent(stage: str, share: float) -> None:
    """Listen to nothing."""
