"""Cells that a test session has solved before are not solved again, in the test modules that say so.

A solution is found again by the whole content of its cell, the task asked for and the settings of the environment. Only
the folder of the cell file is left out, and a solution in whose texts that folder stands is not kept. While any name of
the package is replaced, as ``monkeypatch`` does, everything is solved anew. What is found is read from a file each
time: no test can change what another one gets.
"""

import hashlib
import importlib
import io
import os
import pickle
import pkgutil
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import cellplan
from cellplan.model.cell.cell import Cell
from cellplan.model.origin import Origin
from cellplan.model.progress import Progress
from cellplan.runs.solution import Solution

Events = list[tuple[Any, ...]]  # what was said of the progress, call by call
Names = dict[str, dict[str, object]]  # what each name of a module or class of the package stands for
HARMLESS = {  # names whose replacement changes no figure: where plots and trials run, how often a line is printed
    ("cellplan.guard.forked", "processors"),
    ("cellplan.study.session", "Workers"),
    ("cellplan.cli.terminal.progress", "LINE_EVERY_S"),
}


class Solved(NamedTuple):
    """One solution, before and after the check of its clearance, and the progress reported meanwhile."""

    motion: Solution
    motion_events: Events
    whole: Solution
    clearance_events: Events


@dataclass
class _Entry:
    """Where a solution is kept, and the documents that stand in it by number."""

    path: Path
    origins: list[Origin]
    motion: Solution | None = None
    events: Events = field(default_factory=list)


@dataclass
class _State:
    """What the memo works with: its folder, the names of the package as imported, and the solution in the making."""

    folder: Path | None = None
    names: Names = field(default_factory=dict)
    making: _Entry | None = None
    known: "Solved | None" = None


_state = _State()


@contextmanager
def stored(folder: Path) -> Iterator[None]:
    """Keep solutions in a folder, and take them from there, while the ``with`` statement lasts."""
    folder.mkdir(parents=True, exist_ok=True)
    if not _state.names:
        _install()
    if replaced := _replaced():
        raise RuntimeError(f"names replaced for longer than one test, so that every cell is solved anew: {replaced}")
    before, _state.folder = _state.folder, folder
    try:
        yield
    finally:
        _state.folder, _state.making = before, None


@contextmanager
def solved_anew() -> Iterator[None]:
    """Solve everything while the ``with`` statement lasts, as users' processes do."""
    folder, _state.folder = _state.folder, None
    try:
        yield
    finally:
        _state.folder = folder


def _install() -> None:
    """Import the whole package, put the memo into ``solve`` and remember what every name stands for."""
    for result in pkgutil.walk_packages(cellplan.__path__, "cellplan."):
        if not result.name.endswith("__main__"):
            importlib.import_module(result.name)
    module = importlib.import_module("cellplan.runs.solve")
    module.solve_motion, module.certified = _motion(module.solve_motion), _clearance(module.certified)
    _state.names = _package_names()


def _motion(real: Callable[..., Any]) -> Callable[..., Any]:
    """The first part of ``solve``, without a scene where the solution is known."""

    def solve_motion(
        cell: Cell, *, task: str | None, near: Path | None = None, progress: Progress, early: Any = None
    ) -> tuple[Any, Solution]:
        if early is not None or near is not None:  # begins with what is asked for afterwards, or with another run
            _state.making = None
            return real(cell, task=task, near=near, progress=progress, early=early)
        _state.making = entry = None if _state.folder is None or _is_patched() else _entry(cell, task, _state.folder)
        if entry is None:
            return real(cell, task=task, progress=progress)
        if entry.path.exists():
            _state.known = known = _Reader(entry).load()
            _say(known.motion_events, progress)
            return None, known.motion
        scene, entry.motion = real(cell, task=task, progress=_recorder(progress, entry.events))
        return scene, entry.motion

    return solve_motion


def _clearance(real: Callable[..., Any]) -> Callable[..., Any]:
    """The second part of ``solve``."""

    def with_clearance(
        solution: Solution, *, progress: Progress, early: Any = None, is_reported: bool = True
    ) -> Solution:
        known, _state.known = _state.known, None
        if known is not None and known.motion is solution:
            _say(known.clearance_events, progress)
            return known.whole
        if early is not None or not is_reported:  # without curves, or without figures that only a report states
            return real(solution, progress=progress, early=early, is_reported=is_reported)
        entry = _state.making
        if entry is None or entry.motion is not solution:
            return real(solution, progress=progress)
        events: Events = []
        whole = real(solution, progress=_recorder(progress, events))
        if not _is_patched():
            _write(entry, Solved(solution, entry.events, whole, events))
        return whole

    return with_clearance


def _entry(cell: Cell, task: str | None, folder: Path) -> _Entry:
    """The place of a solution by all that it follows from."""
    entry = _Entry(folder, [])
    text = io.BytesIO()
    environment = sorted((key, value) for key, value in os.environ.items() if key.startswith("CELLPLAN"))
    writer = _KeyWriter(text, entry.origins)
    writer.fast = True  # by values alone, whichever of its parts are one object
    writer.dump((cell, task, environment))
    entry.path = folder / hashlib.sha256(text.getvalue()).hexdigest()
    return entry


def _write(entry: _Entry, solved: Solved) -> None:
    """Keep a solution, unless the place of the cell file stands in it."""
    text = io.BytesIO()
    try:
        _Writer(text, entry.origins).dump(solved)
    except pickle.PicklingError:
        return
    files = {origin.file for origin in entry.origins if origin.file != PurePath(origin.file).name}
    if any(file.encode() in text.getvalue() for file in files):
        return
    draft = entry.path.with_suffix(f".{os.getpid()}")
    draft.write_bytes(text.getvalue())
    draft.replace(entry.path)


class _KeyWriter(pickle.Pickler):
    """Writes a cell; of its documents all but the folder."""

    def __init__(self, file: io.BytesIO, origins: list[Origin]) -> None:
        super().__init__(file)
        self._origins = origins

    def persistent_id(self, obj: object) -> object:
        if not isinstance(obj, Origin):
            return None
        if not any(obj is known for known in self._origins):
            self._origins.append(obj)
        place = next(k for k, known in enumerate(self._origins) if known is obj)
        return place, PurePath(obj.file).name, obj.lines, obj.document, obj.changes, obj.changed


class _Writer(pickle.Pickler):
    """Writes a solution; documents of its cell by their numbers."""

    def __init__(self, file: io.BytesIO, origins: list[Origin]) -> None:
        super().__init__(file)
        self._origins = origins

    def persistent_id(self, obj: object) -> object:
        if not isinstance(obj, Origin):
            return None
        for place, known in enumerate(self._origins):
            if known is obj:
                return place
        raise pickle.PicklingError("a document that is not the cell's")


class _Reader(pickle.Unpickler):
    """Reads a solution; documents are those of the cell that is to be solved."""

    def __init__(self, entry: _Entry) -> None:
        super().__init__(io.BytesIO(entry.path.read_bytes()))
        self._origins = entry.origins

    def persistent_load(self, pid: Any) -> Origin:
        return self._origins[pid]


def _recorder(progress: Progress, events: Events) -> Progress:
    """A listener that writes down what another one is told."""

    def listener(*event: Any) -> None:
        events.append(event)
        progress(*event)

    return listener


def _say(events: Events, progress: Progress) -> None:
    """Report the progress of a solution that is known."""
    for event in events:
        progress(*event)


def _package_names() -> Names:
    """What every name in a module or class of the package stands for."""
    names: Names = {}
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "cellplan":
            names[name] = dict(vars(module))
            for key, value in names[name].items():
                if isinstance(value, type) and value.__module__ == name:
                    names[f"{name}.{key}"] = dict(vars(value))
    return names


def _names_now(holder: str) -> Mapping[str, object]:
    """The names of a module or class as they are; none where it is gone."""
    if holder in sys.modules:
        return vars(sys.modules[holder])
    module, _, name = holder.rpartition(".")
    value = getattr(sys.modules.get(module), name, None)
    return vars(value) if isinstance(value, type) else {}


def _is_patched() -> bool:
    """Whether any name of the package stands for something else than when the memo was installed."""
    return bool(_replaced())


def _replaced() -> list[str]:
    """The names of the package that stand for something else."""
    missing = object()
    changed: list[tuple[str, str]] = []
    for holder, names in _state.names.items():
        now = _names_now(holder)
        changed += [(holder, key) for key, value in names.items() if now.get(key, missing) is not value]
    return [".".join(key) for key in changed if key not in HARMLESS]
