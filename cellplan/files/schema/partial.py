"""The valid entries of a cell file, so that rules between entries are checked in spite of an invalid one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

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
from cellplan.model.settings.layout import LayoutEntry
from cellplan.model.settings.program import ProgramEntry
from cellplan.model.settings.solver import SolverEntry


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
    names = {key: tuple(_section(document, key)) for key in ("robots", "tasks", "environment", "controllers")}
    if whole is None:
        return _by_entry(document, names), findings
    valid = ValidEntries(
        whole=whole,
        robots=whole.robots,
        tasks=whole.tasks,
        environment=whole.environment,
        controllers=whole.controllers or {},
        part=whole.part,
        motion=whole.motion,
        solver=whole.solver,
        checks=whole.checks,
        layout=whole.layout,
        program=whole.program,
        acceleration=whole.acceleration,
        names=names,
    )
    return valid, findings


def _by_entry(document: YamlDocument, names: Mapping[str, tuple[str, ...]]) -> ValidEntries:
    """What is valid of an invalid cell file."""
    return ValidEntries(
        whole=None,
        robots=_named(RobotEntry, document, "robots"),
        tasks=_named(TaskEntry, document, "tasks"),
        environment=_named(ObstacleEntry, document, "environment"),
        controllers=_named(ControllerEntry, document, "controllers"),
        part=_single(PartEntry, document, "part"),
        motion=_single(MotionEntry, document, "motion"),
        solver=_single(SolverEntry, document, "solver"),
        checks=_single(ChecksEntry, document, "checks"),
        layout=_single(LayoutEntry, document, "layout"),
        program=_single(ProgramEntry, document, "program"),
        acceleration=None,
        names=names,
    )


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
