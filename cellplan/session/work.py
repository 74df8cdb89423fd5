"""Heavy work of a session, in worker processes that never delay it: certify, improve, repair, map."""

from importlib import import_module
from typing import Any, Final

from cellplan.guard import Ended, EventProcess
from cellplan.model.cell.cell import Cell
from cellplan.session.works.events import Send, progress_event

KINDS: Final = ("certify", "improve", "repair", "map")
REUSED: Final = frozenset({"certify", "map"})  # layout searches leave the cell in their process that they have read
MOST_IDLE: Final = 2  # [-] processes that stay warm without work

Record = dict[str, Any]


class Works:
    """The work under way, one of each kind: a newer one takes the place of an older one.

    A process without work is always warm, so that none has to wait for imports.
    """

    def __init__(self, cell: Cell) -> None:
        """Begin without work; the first process makes a cell ready meanwhile."""
        self._idle, self._busy = list[EventProcess](), dict[str, EventProcess]()
        self._warm_up(cell)

    @property
    def running(self) -> dict[str, int]:
        """Kinds of the work under way, and the number of the process of each."""
        return {kind: process.number for kind, process in self._busy.items()}

    def start(self, kind: str, *arguments: object) -> None:
        """Begin some work; work of the same kind that is under way is ended.

        Args:
            kind: One of ``KINDS``: name of a function in the file of that name in ``works``.
            *arguments: Those of the function, plain data and cells.
        """
        if kind not in KINDS:
            raise ValueError(f"expected one of {', '.join(KINDS)}, got {kind}")
        self.stop(kind)
        usable = [process for process in self._idle if process.is_usable]
        process = usable.pop(0) if usable else EventProcess()
        self._busy[kind], self._idle = process, usable
        process.begin(work, kind, *arguments)
        if not usable:
            self._warm_up()

    def poll(self) -> list[Record]:
        """Events since the last call, at once."""
        events: list[Record] = []
        for process in self._idle:
            process.poll()  # of making ready: what is wrong shows again in the work
        for kind, process in [*self._busy.items()]:
            for event in process.poll():
                if not isinstance(event, Ended):
                    events.append(event)
                elif event.is_crash or not process.left:
                    self._done(kind, process)
                    events += [_failed(kind, event)] if event.error else [progress_event(kind, 1.0, "done")]
        return events

    def stop(self, kind: str | None = None) -> None:
        """End the work of a kind that is under way; None for all."""
        for name in [*self._busy] if kind is None else [kind]:
            if (process := self._busy.pop(name, None)) is not None:
                process.end()

    def close(self) -> None:
        """End all processes."""
        self.stop()
        while self._idle:
            self._idle.pop().end()

    def _done(self, kind: str, process: EventProcess) -> None:
        """Take a process back, or end it where enough are warm."""
        del self._busy[kind]
        if kind in REUSED and process.is_usable and len(self._idle) < MOST_IDLE:
            self._idle.insert(0, process)  # its bodies are ready
        elif process.is_usable:
            process.end()

    def _warm_up(self, cell: Cell | None = None) -> None:
        """Add a process without work, which imports what it will need."""
        process = EventProcess()
        process.begin(make_ready, cell)
        self._idle.append(process)


def make_ready(cell: Cell | None, **_: Send) -> None:
    """Import what certificates need, and make a cell ready."""
    module = import_module("cellplan.session.works.certify")
    if cell is not None:
        module.make_ready(cell)


def work(kind: str, *arguments: object, send: Send) -> None:
    """Do some work in this process."""
    getattr(import_module(f"cellplan.session.works.{kind}"), kind)(*arguments, send=send)


def _failed(kind: str, event: Ended) -> Record:
    """The event of work without a result."""
    again = "; begin it again" if event.is_crash else ""
    return {"event": "failed", "work": kind, "text": f"{event.error}{again}"}
