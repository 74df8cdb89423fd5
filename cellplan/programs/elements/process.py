"""Process of a task in programs: the statements of its controller, in the three forms that makers have."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.controllers import ControllerEntry, KindName
from cellplan.model.settings.process_statements import (
    DATA_SLOT,
    ProcessStatementsEntry,
    ReadStatement,
    StatementForm,
    read_statement,
)

ENDED: Final = {"abb": ";"}  # with which a statement ends, by kind


@dataclass(frozen=True, slots=True)
class ProcessForm:
    """How a controller begins and ends a process; a motion, a suffix on the motion, or lines after it."""

    kind: KindName
    entry: ProcessStatementsEntry

    @classmethod
    def of(cls, controller: ControllerEntry) -> "ProcessForm | None":
        """The form of a controller; None without process statements."""
        return None if controller.process is None else cls(controller.kind, controller.process)

    @property
    def is_move(self) -> bool:
        """Whether motions themselves begin, continue and end a process."""
        return any(statement.switch.form is StatementForm.MOVE for statement in self._all())

    @property
    def holds_delay(self) -> bool:
        """Whether the controller waits by itself where a process begins and ends; plain outputs do not."""
        return not all(statement.switch.is_output for statement in self._all())

    @property
    def tube(self) -> float:
        """Distance in [m] from its path up to which weave and sensors move a tool in process."""
        return self.entry.weave_mm.si + self.entry.shift_mm.si

    def feed_in(self, task: str) -> str | None:
        """Data from which the controller takes the speed of the tool in a task; None where it is the motion's."""
        return self.entry.feed_in and self.entry.feed_in.replace(DATA_SLOT, self.data(task))

    @property
    def routines(self) -> frozenset[str]:
        """Names, in lower case, of routines that are called: no routine of a program may have one of them."""
        return frozenset(
            statement.words["routine"].rpartition(":")[2] for statement in self._all() if "routine" in statement.words
        )

    def data(self, task: str) -> str:
        """What stands in the slot of the data in statements of a task; empty where no statement has the slot."""
        return self.entry.data.get(task, "")

    def suffix(self, on: bool, task: str) -> str:
        """What stands on the motion to the first or last point; empty where nothing does."""
        return "".join(self._texts(StatementForm.SUFFIX, on=on, task=task))

    def lines(self, on: bool, task: str, *, ahead: bool = False) -> tuple[str, ...]:
        """Statements after the motion to the first or last point, whole; ``ahead``: outputs that it switches ahead."""
        leads = self.entry.lead(on=on) > 0.0
        return self._texts(StatementForm.LINE, on=on, task=task) if leads is ahead else ()

    def move(self, which: Literal["on", "inner", "off"], *, circular: bool, slots: Mapping[str, str]) -> str:
        """A motion to a point in process; a circular one passes the point ``via`` of the slots first."""
        text = self.entry.inner if which == "inner" else next(iter(self.entry.statements(on=which == "on").values()))
        template = text or ""
        if circular:
            head, _, rest = template.partition("{point}")
            template = f"{re.sub('[lL]', 'C', head, count=1)}{{via}}, {{point}}{rest}"
        return _ended(self.kind, template.format_map(slots))

    def _texts(self, form: StatementForm, *, on: bool, task: str) -> tuple[str, ...]:
        """Statements of a form that begin or end the process of a task."""
        return tuple(
            _ended(self.kind, read.text)
            for read in _read(self, on=on, data=self.data(task))
            if read.switch.form is form
        )

    def _all(self) -> tuple[ReadStatement, ...]:
        """All statements, with some data of which each has the same form."""
        data = next(iter(self.entry.data.values()), "")
        return (*_read(self, on=True, data=data), *_read(self, on=False, data=data))


def switches_in_motion(cell: Cell, name: str, *, on: bool) -> bool:
    """Whether the process of a task begins, or ends, while its tool goes on along a run.

    Motions then switch its outputs themselves, or the controller switches none.
    """
    task = cell.task(name)
    control = cell.robot(task.robot).control
    form = None if control is None else ProcessForm.of(cell.controllers[control.id])
    has_run = task.process is not None and task.process.has_runs[0 if on else 1]
    return has_run and (form is None or form.entry.lead(on=on) > 0.0)


def shared_outputs(cell: Cell, tasks: Sequence[str]) -> Iterator[InputError]:
    """Outputs that one of some tasks, which are done at once, would switch off while another one needs them."""
    used: dict[tuple[str, str], str] = {}
    for task in map(cell.task, tasks):
        control = cell.robot(task.robot).control
        if control is None or task.process is None:
            continue
        form = ProcessForm.of(cell.controllers[control.id])
        begun = () if form is None else _read(form, on=True, data=form.data(task.name))
        for output in (read.words["name"] for read in begun if read.switch.is_output):
            other = used.setdefault((control.id, output), task.name)
            if other != task.name:
                yield InputError(
                    f"controllers.{control.id}.process: expected an output for each of the tasks '{other}' and "
                    f"'{task.name}', which are done at once, by the slot {DATA_SLOT}, got {output} for both"
                )


def _read(form: ProcessForm, *, on: bool, data: str) -> tuple[ReadStatement, ...]:
    """Statements that begin or end a process, with some data."""
    texts = (text.replace(DATA_SLOT, data) for text in form.entry.statements(on=on).values())
    return tuple(read for text in texts if (read := read_statement(form.kind, text, on=on)) is not None)


def _ended(kind: KindName, statement: str) -> str:
    """A statement with the sign that ends it."""
    end = ENDED.get(kind, "")
    return statement.removesuffix(end) + end
