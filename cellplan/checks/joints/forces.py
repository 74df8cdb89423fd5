"""Checks of static forces: moments of load and process about the wrist, and grips that hold by friction."""

from collections.abc import Iterator
from typing import Final

from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.forces import ForceReport, GripUse, JointLoad
from cellplan.model.report.report import Check
from cellplan.scene.dynamics.loads import part_share, tool_mass

PERCENT: Final = 100.0
LEAST: Final = 1e-9  # [N m] a smaller moment is none


def check_forces(cell: Cell, forces: ForceReport) -> list[Check]:
    """Moments about axes of the wrist where a process acts and all loads are stated; grips with stated friction."""
    moments = (check for load in forces.joints for check in _moments(cell, cell.robot(load.robot), load))
    return [*moments, *(_grip(use) for use in forces.grips)]


def _moments(cell: Cell, robot: Robot, load: JointLoad) -> Iterator[Check]:
    """The moment of load and process about one axis against that which the robot may carry."""
    limit = None if robot.model.payload is None else robot.model.payload.axes.get(load.joint)
    masses = tool_mass(robot), part_share(cell, robot)
    if limit is None or limit.moment_nm is None or None in masses or load.by_process.size < LEAST:
        return
    subject, worst, most = f"{load.robot}/{load.joint}", load.moving, limit.moment_nm
    text = (
        f"process {subject}: moment of load and process {worst.size:.2f} Nm at {worst.at_s:.3f} s "
        f"({load.total.size:.2f} Nm at rest, {load.by_process.size:.2f} Nm by the process alone), allowed {most:g} Nm"
    )
    passed = worst.size <= most
    yield Check("process_moment", subject, passed, text, value=worst.size, limit=most, unit="Nm", at_s=worst.at_s)


def _grip(use: GripUse) -> Check:
    """Whether friction holds the part."""
    share, across = PERCENT * use.share, ""
    if use.across > LEAST:
        across = f"; up to {use.across:.4g} Nm across it not judged"
    text = (
        f"grip of {use.robot}: needs {share:.1f} % of its friction at {use.at_s:.3f} s ({use.tangential:.4g} N along "
        f"the pads, {use.torsion:.4g} Nm about their normal, {use.normal:.4g} N along it){across}"
    )
    return Check("grip_slip", use.robot, use.share <= 1.0, text, value=share, limit=PERCENT, unit="%", at_s=use.at_s)
