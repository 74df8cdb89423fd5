"""Actions of a session that take longer than an answer: work in other processes, and what it offers."""

import contextlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from cellplan.errors import InputError
from cellplan.report.record.common import Record
from cellplan.session.document import Document
from cellplan.session.engine import Engine
from cellplan.session.pictures import picture, picture_of
from cellplan.session.work import KINDS, Works
from cellplan.session.works.request import request_of


class Certificate(NamedTuple):
    """What certifying a state has come to."""

    values: Mapping[str, object]  # of the state, as far as they differ from the file, by address
    picture: Record  # of the state
    passed: bool = False
    text: str = ""  # the verdict in one line


class Actions:
    """Work on the cell of a document; the first of it starts the processes.

    Attributes:
        certificate: The last one of a state, until the file is another one.
        certified: Picture of the last state that was certified, until then; None without one.
    """

    def __init__(self, document: Document) -> None:
        """Begin without work."""
        self._document = document
        self._works: Works | None = None
        self._noted = list[Record]()  # events that were not asked for yet
        self.certificate: Certificate | None = None
        self.certified: Record | None = None
        self._certifying: Certificate | None = None  # of the state that is being certified
        self._offers = list[Mapping[str, object]]()  # values of trials and remedies, by their numbers

    def get_ready(self) -> Works:
        """Start a process that imports what work needs, so that none has to wait for it."""
        self._works = self._works or Works(self._document.given)
        return self._works

    def start(self, kind: str, argument: float | None, engine: Engine) -> None:
        """Begin some work.

        Args:
            kind: One of ``KINDS``.
            argument: Seconds of an improvement; of a map the number of the robot, the first operator without one.
            engine: The values; their version stands in the verdict.

        Raises:
            InputError: There is no such robot, or the values do not go together.
        """
        if kind not in KINDS:
            raise InputError(f"action: expected one that is known, got '{kind}'")
        cell, works = self._document.cell, self.get_ready()
        arguments: tuple[object, ...]
        if kind == "certify":
            arguments = (cell, engine.version)
            self._certifying = Certificate({**self._document.changes.values}, picture(engine.record()))
        elif kind == "map":
            operators = [cell.index(task.robot) for task in cell.tasks if task.robot not in cell.positioners]
            number = argument if argument is not None else next(iter(operators), 0)
            if number not in range(len(cell.robots)):
                raise InputError(f"map: expected the number of a robot below {len(cell.robots)}, got {number:g}")
            arguments = (cell, cell.robots[int(number)].name)
        else:
            arguments = request_of(self._document)
            arguments += () if argument is None or kind == "repair" else (float(argument),)
        works.start(kind, *arguments)

    def stop(self) -> None:
        """End all work."""
        if self._works is not None:
            self._works.stop()

    def offered(self, number: float | None) -> Mapping[str, object]:
        """Values of a trial or a remedy by its number; of the last one for None.

        Raises:
            InputError: There is none.
        """
        place = len(self._offers) - 1 if number is None else number
        if place not in range(len(self._offers)):
            raise InputError(f"take: expected a number below {len(self._offers)}, got {place:g}")
        return self._offers[int(place)]

    def follow(self, action: str, before: Mapping[str, object]) -> None:
        """Let certificates go with their states: saved, a state has no changes; of another file they say nothing.

        Args:
            action: What was done to the file.
            before: What was changed until then, by address.
        """
        if action != "save":
            self.certificate = self._certifying = self.certified = None
            return
        after = {**self._document.changes.values}
        self._certifying, self.certificate = (
            it._replace(values=after) if it is not None and it.values == before else it
            for it in (self._certifying, self.certificate)
        )

    def note(self, event: Record | None) -> None:
        """Let an event be among the next ones; nothing for None."""
        self._noted += [] if event is None else [event]

    def events(self, engine: Engine) -> list[Record]:
        """Events since the last call; what is offered has a number to take it by, and a picture."""
        noted, self._noted = self._noted, []
        events = self._works.poll() if self._works else []
        return [*noted, *(self._completed(event, engine) for event in events)]

    def close(self) -> None:
        """End all work and all processes."""
        if self._works is not None:
            self._works.close()
        self._works = None

    def _completed(self, event: Record, engine: Engine) -> Record:
        """An event with the numbers and pictures of what it offers, or the picture of what is certified."""
        if event["event"] == "verdict" and self._certifying is not None:
            failed = next((line.strip() for line in event["lines"] if "FAILED" in line), event["lines"][0])
            text = "every check passed" if event["passed"] else failed
            self.certificate = self._certifying._replace(passed=event["passed"], text=text)
            self.certified = self.certificate.picture if event["passed"] else self.certified
            return {**event, "picture": self.certified}
        if event["event"] == "trial":
            return {**event, **self._offer(event["values"], engine)}
        if event["event"] == "remedies":
            remedies: list[Any] = event["remedies"]
            return {**event, "remedies": [{**it, **self._offer(it["values"], engine)} for it in remedies]}
        return event

    def _offer(self, values: Mapping[str, object], engine: Engine) -> Record:
        """Number and picture of values that can be taken."""
        self._offers.append(values)
        shown = None
        with contextlib.suppress(InputError):
            shown = picture_of(self._document.cell.with_values(values), engine.given, engine.shown)
        return {"number": len(self._offers) - 1, "picture": shown}
