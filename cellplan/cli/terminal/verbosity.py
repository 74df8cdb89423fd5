"""``-v``: what a command does, how long it takes and how much work it is, on the error stream by named loggers."""

import logging
import os
import time
from collections.abc import Mapping
from typing import Any, Final

from cellplan.cli.terminal.errors import tell

STAGES: Final = logging.getLogger("cellplan.stages")  # wall and processor time of each stage
EFFORT: Final = logging.getLogger("cellplan.effort")  # counts: samples, nodes, queries


class _ErrorStream(logging.Handler):
    """Writes records to the error stream of the moment, one line each."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        tell(f"{record.name.removeprefix('cellplan.')}: {record.getMessage()}")


def be_verbose(desired: bool) -> None:
    """Show what the named loggers say, or do not."""
    logger = logging.getLogger("cellplan")
    logger.handlers = [handler for handler in logger.handlers if not isinstance(handler, _ErrorStream)]
    logger.setLevel(logging.INFO if desired else logging.NOTSET)
    if desired:
        logger.addHandler(_ErrorStream())


class StageTimes:
    """Wall and processor time of one stage after the other."""

    def __init__(self) -> None:
        """Begin with what happens before the first stage."""
        self._stage = "reading"
        self._begun = self._first = _now()

    def at(self, stage: str) -> None:
        """Note the stage; when it is another one than before, that one has ended."""
        if stage != self._stage:
            self._log(self._stage, self._begun)
            self._stage, self._begun = stage, _now()

    def end(self) -> None:
        """Note the end of the last stage and of all."""
        self._log(self._stage, self._begun)
        self._log("all", self._first)

    @staticmethod
    def _log(stage: str, begun: tuple[float, float]) -> None:
        wall, processor = (now - then for now, then in zip(_now(), begun, strict=True))
        STAGES.info("%-34s %7.3f s, processor %7.3f s", stage, wall, processor)


def log_effort(record: Mapping[str, Any]) -> None:
    """Counts of a solved run."""
    joints = sum(map(len, record["joints"].values()))
    checks = len(record["checks"])
    EFFORT.info("%d samples of %d joints, %d checks", record.get("samples", 0), joints, checks)
    resolution = record["solver"].get("resolution")
    if resolution and resolution["nodes"]:
        counts = (resolution["nodes"], resolution["panels"], resolution["sweeps"], resolution["solves"])
        EFFORT.info("%d nodes in %d panels, %d sweeps, %d linear systems", *counts)
    proof = record.get("clearance_proof")
    if proof:
        counts = (record["pair_count"], proof["distance_queries"], proof["contact_queries"], proof["cut_steps"])
        EFFORT.info("%d pairs, %d distance queries, %d contact queries, %d steps cut finer", *counts)


def _now() -> tuple[float, float]:
    """Wall time and processor time, children that have ended included, in [s]."""
    spent = os.times()
    return time.perf_counter(), time.process_time() + spent.children_user + spent.children_system
