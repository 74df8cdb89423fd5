"""Progress callback of long stages: stage and fraction done."""

from collections.abc import Callable

Progress = Callable[[str, float], None]  # (stage, fraction done from 0 to 1)


def silent(stage: str, share: float) -> None:
    """Report no progress."""
