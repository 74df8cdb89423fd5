"""Events of heavy work."""

import time
from collections.abc import Callable
from typing import Any, Final

from cellplan.model.progress import Progress

Send = Callable[[dict[str, Any]], None]
EVERY_S: Final = 0.2  # [s] between two events on the progress of a stage


def progress_event(work: str, fraction: float, text: str) -> dict[str, Any]:
    """How far some work is, from 0 to 1."""
    return {"event": "progress", "work": work, "fraction": min(1.0, max(0.0, fraction)), "text": text}


def progress_of(work: str, send: Send) -> Progress:
    """A listener that sends each new stage, and now and then how far it is."""
    last, last_stage = 0.0, ""

    def listen(stage: str, fraction: float) -> None:
        nonlocal last, last_stage
        if stage != last_stage or time.monotonic() - last >= EVERY_S:
            last, last_stage = time.monotonic(), stage
            send(progress_event(work, fraction, stage))

    return listen
