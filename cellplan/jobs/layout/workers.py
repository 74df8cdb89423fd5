"""Worker processes of a layout search, which begin before the command has imported what it needs itself."""

from functools import partial
from importlib import import_module
from typing import Any, Final

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.search.programs.objective import Objective
from cellplan.study.workers import Workers

TRIAL: Final = "cellplan.jobs.layout.trials.trial"


def layout_workers(count: int, request: LayoutRequest) -> Workers:
    """Worker processes, for a ``with`` statement; they make the cell ready while the caller goes on.

    Where the first conforming layout ends the search, mostly the first trial is the last one: one process begins, with
    that trial.
    """
    is_one = request.objective is Objective.CONFORMING
    first = partial(_call, "evaluate_first" if is_one else "prepared", request.anywhere)
    return Workers(count, modules=(TRIAL,), first=first, at_once=1 if is_one else None)


def _call(name: str, *arguments: object) -> Any:
    """Call a function of the trials, which only the worker imports."""
    return getattr(import_module(TRIAL), name)(*arguments)
