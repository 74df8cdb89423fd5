"""The valid entries of a cell file, so that rules between entries are checked in spite of an invalid one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from cellplan.files.input.findings import Finding
from cellplan.files.schema.cell import OBSTACLE_LIMIT, ROBOT_LIMIT, TASK_LIMIT, CellDocument, MotionEntry, PartEntry
from cellplan.files.schema.messages import AnyEntry, valid_entry, validate
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.schema.shapes import ObstacleEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.settings.acceleration import AccelerationChoice
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.entry import Entry
from cellplan.model.settings.layout import LayoutEntry
from cellplan.model.settings.program import ProgramEntry
from cellplan.model.settings.solver import SolverEntry

NAMED: Final[Mapping[str, type[Entry]]] = {
    "robots": RobotEntry,
    "tasks": TaskEntry,
    "environment": ObstacleEntry,
    "controllers": ControllerEntry,
}  # sections with entries by name
SINGLE: Final[Mapping[str, type[Entry]]] = {
    "part": PartEntry,
    "motion": MotionEntry,
    "solver": SolverEntry,
    "checks": ChecksEntry,
    "layout": LayoutEntry,
    "program": ProgramEntry,
}  # sections that are one entry


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidEntries:
    """The entries of a cell file that conform to the format."""

    whole: CellDocument | None  # the whole file; None when any entry is invalid
    robots: Mapping[str, RobotEntry]  # valid robots by name
    tasks: Mapping[str, TaskEntry]  # valid tasks by name
    environment: Mapping[str, ObstacleEntry]  # valid obstacles by name
    controllers: Mapping[str, ControllerEntry]  # valid controllers by name
    part: PartEntry | None  # the part, if valid
    motion: MotionEntry | None  # the motion, if valid
    solver: SolverEntry | None  # the solver's settings, if valid
    checks: ChecksEntry | None  # the checks, if valid
    layout: LayoutEntry | None  # the layout, if given and valid
    program: ProgramEntry | None  # the program from home to home, if given and valid
    acceleration: AccelerationChoice | None  # the cell's rule for accelerations, if the whole file is valid
    names: Mapping[str, tuple[str, ...]]  # all names in each section, of valid and invalid entries

    @property
    def is_too_large(self) -> bool:
        """Whether there are more robots or tasks than any cell has, so that no other finding matters."""
        return len(self.robots) > ROBOT_LIMIT or len(self.tasks) > TASK_LIMIT or not self.names["robots"]


def read_valid_entries(document: YamlDocument) -> tuple[ValidEntries, list[Finding]]:
    """Validate a cell file, and entry by entry where anything of it is invalid; the findings name what is."""
    whole, findings = validate(CellDocument, document)
    names = {key: tuple(_section(document, key)) for key in NAMED}
    if whole is None:
        entries: dict[str, Any] = {key: _named(model, document, key) for key, model in NAMED.items()}
        entries |= {key: _single(model, document, key) for key, model in SINGLE.items()}
        entries["acceleration"] = None
    else:
        entries = {key: getattr(whole, key) for key in (*NAMED, *SINGLE, "acceleration")}
    return ValidEntries(whole=whole, names=names, **entries | {"controllers": entries["controllers"] or {}}), findings


def _section(document: YamlDocument, key: str) -> Mapping[str, Any]:
    """Entries of a section by name; none when it is no mapping or far too large."""
    section = document.root.get(key)
    return section if isinstance(section, dict) and len(section) <= OBSTACLE_LIMIT else {}


def _named(model: type[AnyEntry], document: YamlDocument, key: str) -> dict[str, AnyEntry]:
    """Valid entries of a section by name."""
    entries = {name: valid_entry(model, document, (key, name)) for name in _section(document, key)}
    return {name: entry for name, entry in entries.items() if entry is not None}


def _single(model: type[AnyEntry], document: YamlDocument, key: str) -> AnyEntry | None:
    """A section that is one entry; its defaults when it is absent and may be."""
    if key not in document.root:
        return None if key in {"part", "motion", "layout", "program"} else model()
    return valid_entry(model, document, (key,))
