"""What of a cell file can be understood, so that one mistake does not hide the others."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellplan.io.input.findings import Finding
from cellplan.io.schema.acceleration import AccelerationChoice
from cellplan.io.schema.cell import (
    OBSTACLE_LIMIT,
    ROBOT_LIMIT,
    TASK_LIMIT,
    CellDocument,
    ChecksEntry,
    LayoutEntry,
    MotionEntry,
    PartEntry,
)
from cellplan.io.schema.messages import AnyEntry, understood, validate
from cellplan.io.schema.robot import RobotEntry
from cellplan.io.schema.shapes import ObstacleEntry
from cellplan.io.schema.solver import SolverEntry
from cellplan.io.schema.task import TaskEntry
from cellplan.io.yaml.reader import YamlDocument


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """The sound parts of a cell file.

    Attributes:
        whole: The whole file; None when anything in it is not understood.
        robots: Robots that are understood, by name.
        tasks: Tasks that are understood, by name.
        environment: Obstacles that are understood, by name.
        part: The part, if understood.
        motion: The motion, if understood.
        solver: The solver's settings, if understood.
        checks: The checks, if understood.
        layout: The layout, if given and understood.
        acceleration: What the cell says of accelerations, if the whole file is understood.
        names: All names that the file gives in each section, understood or not.
    """

    whole: CellDocument | None
    robots: Mapping[str, RobotEntry]
    tasks: Mapping[str, TaskEntry]
    environment: Mapping[str, ObstacleEntry]
    part: PartEntry | None
    motion: MotionEntry | None
    solver: SolverEntry | None
    checks: ChecksEntry | None
    layout: LayoutEntry | None
    acceleration: AccelerationChoice | None
    names: Mapping[str, tuple[str, ...]]

    @property
    def is_too_large(self) -> bool:
        """Whether there are more robots or tasks than any cell has, so that no other finding matters."""
        return len(self.robots) > ROBOT_LIMIT or len(self.tasks) > TASK_LIMIT or not self.names["robots"]


def read_pieces(document: YamlDocument) -> tuple[Pieces, list[Finding]]:
    """Parse a cell file as far as possible; the findings name the rest."""
    whole, findings = validate(CellDocument, document)
    pieces = Pieces(
        whole=whole,
        robots=_named(RobotEntry, document, "robots"),
        tasks=_named(TaskEntry, document, "tasks"),
        environment=_named(ObstacleEntry, document, "environment"),
        part=_single(PartEntry, document, "part"),
        motion=_single(MotionEntry, document, "motion"),
        solver=_single(SolverEntry, document, "solver"),
        checks=_single(ChecksEntry, document, "checks"),
        layout=_single(LayoutEntry, document, "layout"),
        acceleration=None if whole is None else whole.acceleration,
        names={key: tuple(_section(document, key)) for key in ("robots", "tasks", "environment")},
    )
    return pieces, findings


def _section(document: YamlDocument, key: str) -> Mapping[str, Any]:
    """Entries of a section by name; none when it is something else or far too much."""
    section = document.root.get(key)
    return section if isinstance(section, dict) and len(section) <= OBSTACLE_LIMIT else {}


def _named(model: type[AnyEntry], document: YamlDocument, key: str) -> dict[str, AnyEntry]:
    """Entries of a section that are understood."""
    found = {name: understood(model, document, (key, name)) for name in _section(document, key)}
    return {name: entry for name, entry in found.items() if entry is not None}


def _single(model: type[AnyEntry], document: YamlDocument, key: str) -> AnyEntry | None:
    """A section that is one entry; its defaults when it is absent and may be."""
    if key not in document.root:
        return None if key in {"part", "motion", "layout"} else model()
    return understood(model, document, (key,))
