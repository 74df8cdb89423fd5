"""Session: a cell whose layout is changed; each change is answered with what becomes of the whole job."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from cellplan.errors import InputError
from cellplan.files.input.findings import shown
from cellplan.report.record.common import Record
from cellplan.scene.scene import Scene
from cellplan.session.actions import Actions
from cellplan.session.answer import CERTIFIED, FAILS, PLANNED
from cellplan.session.document import Document
from cellplan.session.engine import Engine
from cellplan.session.executor import Executor, InlineExecutor
from cellplan.session.starts import ADDRESS, unstated
from cellplan.session.work import KINDS

SCHEMA: Final = "cellplan.edit/1"


def edit(cell: Path | str, *, settings: Iterable[str] = (), allow_dirs: Sequence[Path] = ()) -> "Session":
    """Open a cell file whose layout is changed, each change answered with what becomes of the whole job.

    Args:
        cell: The file; nothing is written into it but by ``do("save")``.
        settings: Values set in the cell from the beginning, each as ``KEY=VALUE``.
        allow_dirs: Further folders that the files it names may lie in.

    Returns:
        The session, also for a ``with`` statement.

    Raises:
        InputError: The cell cannot be read, or not be worked with.
    """
    return Session.open(Path(cell), settings=settings, allow_dirs=allow_dirs)


class Session(AbstractContextManager["Session"]):
    """A cell file that is open. It is called from one thread, and starts none.

    Attributes:
        document: The file, what was changed of it, and the cell with that.
    """

    def __init__(self, document: Document, executor: Executor) -> None:
        """Use ``open``."""
        self.document, self._executor, self._number = document, executor, 0
        self._engine, self._actions = Engine(document.given, executor), Actions(document)

    @classmethod
    def open(
        cls,
        cell: Path,
        *,
        settings: Iterable[str] = (),
        allow_dirs: Sequence[Path] = (),
        executor: Executor | None = None,
    ) -> Self:
        """Open a cell file; see ``edit``.

        Args:
            executor: Works out what takes longer than an answer: in another process, whose results ``poll`` has; in
                this one for None, so that answers are whole.
        """
        return cls(Document(cell, settings, allow_dirs), executor or InlineExecutor())

    def open_record(self) -> Record:
        """What a page needs once; a process gets ready for its work meanwhile."""
        self._actions.get_ready()
        name, file, certified = self.document.cell.name, self.document.path.name, self._actions.certified
        about = {"schema": SCHEMA, "cell": name, "file": file, "certified": certified}
        return {**about, **self._engine.page(), "answer": self.answer()}

    def change(self, values: Mapping[str, float], *, block: int | None = None, number: int = 0) -> Record:
        """Set values, and say what becomes of the block that is shown.

        Args:
            values: New values in file units by address; what the layout ties to them follows.
            block: Number of the block to be shown; None for the one that is.
            number: Of the change, repeated in the answer.

        Raises:
            InputError: An address is not that of a variable, it is locked, or a value is no number of its range.
        """
        engine = self._engine
        if not isinstance(block, int | None):
            raise InputError(f"block: expected the number of one, got {shown(block)}")
        accepted = engine.given.variables.accepted(values)
        self._number = number
        engine.move({**engine.values, **accepted}, block)
        if accepted:
            self.document.changes.set({**accepted, **engine.starts()})
        return self.answer()

    def move(self, robot: str, **components: float) -> Record:
        """Put the base of a robot elsewhere: ``session.move("kuka", x_mm=900)``; see ``change``."""
        return self.change({f"robots.{robot}.base.{key}": value for key, value in components.items()})

    def advise(self) -> bool:
        """Find out what would help between two changes, a bounded piece of work; False where there is nothing to do.

        It stands in later answers. Without this it is found out at rest.
        """
        return self._engine.advise()

    def settle(self) -> Record | None:
        """A fuller answer, a bounded piece of work at a time; None once there is nothing left to do here."""
        self.document.changes.complete()
        try:
            _write_starts(self.document, self._engine.starts())
            cell = self.document.cell
        except InputError as error:
            return self.answer() if self._engine.refuse(error) else None
        return self.answer() if self._engine.settle(cell) else None

    def do(self, action: str, argument: float | None = None) -> Record:
        """Do something else than a change, and say what becomes of the block that is shown.

        Args:
            action: undo, redo, reset, save, reload, keep, take, certify, improve, repair, map, stop or end.
            argument: Of take the number of what was offered, of map that of the robot, of improve its seconds; 1 saves
                another file.

        Raises:
            InputError: There is no such action, or it is refused.
        """
        document, changes, actions = self.document, self.document.changes, self._actions
        if not isinstance(argument, int | float | None):
            raise InputError(f"{action}: expected a number with it, got {shown(argument)}")
        if action in {"save", *KINDS}:
            _write_starts(document, self._engine.starts(of_all=True))
        values: dict[str, Callable[[], Record | None]] = {
            "undo": changes.undo,
            "redo": changes.redo,
            "reset": changes.reset,
            "take": lambda: changes.set(actions.offered(argument)),
            "save": lambda: _saved(document, as_another=bool(argument)),
            "reload": document.reload,
            "keep": document.keep,
        }
        if action in values:
            before = changes.values
            actions.note(values[action]())
            if action in {"save", "reload", "keep"}:
                actions.follow(action, before)
            self._engine = _restored(self._engine, document, self._executor)
        elif action in {"stop", "end"}:
            (actions.stop if action == "stop" else self.close)()
        else:
            actions.start(action, argument, self._engine)
        return self.answer()

    def poll(self) -> list[Record]:
        """What has happened in the background since it was asked last; it never waits."""
        events, is_new = self._actions.events(self._engine), self._engine.take()
        for event in events:
            if event["event"] == "verdict":
                is_new = True
                if event["passed"] and event["version"] == self._engine.version:
                    self._engine.hold()
        if (seen := self.document.look()) is not None:
            events.append(seen)
            if seen["state"] == "changed":
                self._engine, is_new = _restored(self._engine, self.document, self._executor), True
                self._actions.follow("changed", {})
        return [*events, *([{"event": "answer", "answer": self.answer()}] if is_new else [])]

    def answer(self) -> Record:
        """What is known of the present values."""
        document, record = self.document, self._engine.record()
        certificate = self._actions.certificate
        if certificate is not None and certificate.values == document.changes.values:
            state = CERTIFIED if certificate.passed else FAILS if record["state"] == PLANNED else record["state"]
            record = {**record, "state": state, "verdict": f"{state}: {certificate.text}"}
        can = {"undo": document.changes.can_undo, "redo": document.changes.can_redo, "save": bool(document.history)}
        return {
            "number": self._number,
            **record,
            "can": can,
            "history": document.history,
            "is_saved": not document.history,
        }

    def close(self) -> None:
        """End what works in the background."""
        self._actions.close()
        self._executor.close()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """See ``close``."""
        self.close()


def _write_starts(document: Document, starts: Mapping[str, object]) -> None:
    """Let robots begin as the blocks of the live cell do, as a base moves below all of its tasks."""
    document.changes.add(unstated(document.cell, starts))


def _saved(document: Document, *, as_another: bool) -> Record:
    """Save values that go together; others are refused, as the file would not open again."""
    Scene.from_cell(document.cell)
    return document.save(as_another=as_another)


def _restored(engine: Engine, document: Document, executor: Executor) -> Engine:
    """The engine at the values of a document; another one where more than variables is another than before."""
    variables = engine.given.variables
    others = {
        address: value
        for address, value in document.changes.values.items()
        if variables.at(address) is None and ADDRESS.fullmatch(address) is None
    }
    if others != engine.others or document.given is not engine.origin:
        shown = engine.given.blocks[engine.shown].name
        engine = Engine(document.given, executor, others, shown, engine.version)
    try:
        engine.restore(document.cell)
    except InputError as error:  # the values do not go together, as before a change that was undone
        values = document.changes.values
        numbers = {it: value for it, value in values.items() if isinstance(value, int | float) and variables.at(it)}
        engine.move(numbers)
        engine.refuse(error)
    return engine
