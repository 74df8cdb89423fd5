"""Head of a program: what it promises, what it was made from, and the home by which a person checks the zero."""

from typing import Final

from cellplan.model.report.exported import ExportJob
from cellplan.programs.elements.joints import to_numbers
from cellplan.programs.elements.text import fixed

HOME_DECIMALS: Final = 3


def head_notes(job: ExportJob, robot: str) -> list[str]:
    """Notes for comments at the head of a robot's files, of any characters; ``text.comment`` makes lines of them."""
    placed = job.frame.robot(robot)
    zero = placed.model.controller
    known = "not stated; the zero of the model is written" if zero is None else f"known from: {zero.source}"
    return [
        *job.notes,
        f"robot {robot}, model {placed.model.name}",
        f"home in controller positions: {home_text(job, robot)}",
        f"zero of the controller {known}",
    ]


def home_text(job: ExportJob, robot: str) -> str:
    """Home of a robot, or its first row where it has no home, as its controller shows it: ``A1 0.000 deg, …``."""
    placed = job.frame.robot(robot)
    q = placed.home if placed.home is not None else job.programs[0].robots[robot].q[0]
    numbers = to_numbers(placed, q[None], decimals=HOME_DECIMALS)[0]
    return ", ".join(
        f"{joint.name} {fixed(number, HOME_DECIMALS)} {joint.display_unit.name}"
        for joint, number in zip(placed.model.joints, numbers, strict=True)
    )
