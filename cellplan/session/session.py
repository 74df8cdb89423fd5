"""Session: a cell that is changed while it is looked at; each change is answered with what becomes of the whole job."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from cellplan.errors import InputError
from cellplan.report.record.common import Record
from cellplan.session.answer import CERTIFIED, PLANNED
from cellplan.session.document import Document
from cellplan.session.engine import Engine

SCHEMA: Final = "cellplan.edit/1"


class Session:
    """A cell file that is open; ``cellplan.edit`` opens one. It is called from one thread, and starts none."""

    def __init__(self, document: Document) -> None:
        """Use ``open``."""
        self._document, self._engine = document, Engine(document.given)
        self._version = self._number = 0
        self._pending: Iterator[None] | None = None  # what is still to be found out at rest
        self._certified: Mapping[str, object] | None = None  # values of the last certified state

    @classmethod
    def open(cls, cell: Path | str, *, settings: Iterable[str] = (), allow_dirs: Sequence[Path] = ()) -> Self:
        """Open a cell file.

        Args:
            cell: The file.
            settings: Values set in the cell from the beginning, each as ``KEY=VALUE``.
            allow_dirs: Further folders that the files it names may lie in.

        Raises:
            InputError: The cell cannot be read, or not be worked with.
        """
        return cls(Document(Path(cell), settings, allow_dirs))

    def open_record(self) -> Record:
        """What a page needs once."""
        name, file = self._document.cell.name, self._document.path.name
        return {"schema": SCHEMA, "cell": name, "file": file, **self._engine.page(), "answer": self.answer()}

    def change(self, values: Mapping[str, float], *, block: int | None = None, number: int = 0) -> Record:
        """Set values, and say what becomes of the block that is shown.

        Args:
            values: New values in file units by address.
            block: Number of the block to be shown; None for the one that is.
            number: Of the change, repeated in the answer.

        Raises:
            InputError: An address is not that of a variable, it is locked, or a value is out of its range.
        """
        engine = self._engine
        accepted = {address: engine.variable(address).accepted(float(value)) for address, value in values.items()}
        self._number = number
        self._look({**engine.values, **accepted}, block)
        if accepted:
            self._document.changes.set({**accepted, **engine.starts()})
        return self.answer()

    def move(self, robot: str, **components: float) -> Record:
        """Put the base of a robot elsewhere: ``session.move("kuka", x_mm=900)``; see ``change``."""
        return self.change({f"robots.{robot}.base.{key}": value for key, value in components.items()})

    def settle(self) -> Record | None:
        """A fuller answer, a bounded piece of work at a time; None once there is nothing left to do."""
        if self._pending is None:
            self._document.changes.complete()
            self._pending = self._engine.settle(self._document.cell)
        for _ in self._pending:
            return self.answer()
        return None

    def do(self, action: str, argument: float | None = None) -> Record:
        """Do something else than a change, and say what becomes of the block that is shown.

        Raises:
            InputError: There is no such action, or it is refused.
        """
        changes, document = self._document.changes, self._document
        actions: dict[str, Callable[[], Any]] = {
            "undo": changes.undo,
            "redo": changes.redo,
            "reset": changes.reset,
            "save": document.save,
            "reload": document.reload,
            "keep": document.keep,
            "end": self.close,
        }
        if action not in actions:
            raise InputError(f"action: expected one of {', '.join(actions)}, got '{action}'")
        actions[action]()
        if action in {"save", "reload", "keep"}:
            self._engine = Engine(document.given, self._engine.shown)
        self._look(self._numbers(), None)
        return self.answer()

    def poll(self) -> list[Record]:
        """What has happened in the background since it was asked last; it never waits."""
        event = self._document.look()
        if event is None:
            return []
        if event["state"] != "changed":
            return [event]
        self._engine = Engine(self._document.given, self._engine.shown)
        self._look(self._numbers(), None)
        return [event, {"event": "answer", "answer": self.answer()}]

    def answer(self) -> Record:
        """What is known of the present values."""
        document, record = self._document, self._engine.record()
        if record["state"] == PLANNED and self._certified == document.changes.values:
            record |= {"state": CERTIFIED, "verdict": f"{CERTIFIED}: every check passed"}
        can = {"undo": document.changes.can_undo, "redo": document.changes.can_redo, "save": bool(document.history)}
        return {
            "number": self._number,
            "version": self._version,
            **record,
            "can": can,
            "history": document.history,
            "is_saved": not document.history,
        }

    def close(self) -> None:
        """End what works in the background."""

    def __enter__(self) -> Self:
        """Begin a ``with`` statement."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """See ``close``."""
        self.close()

    def _look(self, values: Mapping[str, float], block: int | None) -> None:
        """Look at a block at other values."""
        self._engine.move(values, block)
        self._version, self._pending = self._version + 1, None

    def _numbers(self) -> dict[str, float]:
        """The values of the document that are variables."""
        values = self._document.changes.values
        known = {variable.address for variable in self._engine.given.variables.listed}
        return {address: float(str(value)) for address, value in values.items() if address in known}
