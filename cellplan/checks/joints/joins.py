"""Rows in which phases of a program meet: each phase is judged as if joints rested beside it; here both sides count."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cellplan.checks.joints.via_points import with_via_points
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_limits import acceleration_limit
from cellplan.model.report.report import Check, Report


def check_joins(cell: Cell, reports: Sequence[Report]) -> Check:
    """The largest acceleration of a joint at a row that two phases share, against its limit.

    At such a row the acceleration is the change of velocity from the step before it to the step after it, over a step.

    Args:
        reports: Reports of the phases of one cycle in their order, each of which begins in the last row of the one
            before; the last is followed by the first.

    Returns:
        One check for the whole program; its time counts from the begin of the phase that it names.
    """
    worst = (-1.0, "", 0.0, 0.0, "/s2")
    for before, after in pairwise([*reports, reports[0]]):
        step = float(after.times[1] - after.times[0])
        for robot in cell.robots:
            one, other = before.q[robot.name], after.q[robot.name]
            accelerations = np.abs((other[1] - other[0]) - (one[-1] - one[-2])) / step**2
            for index, joint in enumerate(robot.model.joints):
                limit, (unit, scale) = acceleration_limit(robot, index)[0], joint.display_unit
                value = float(accelerations[index])
                if limit is not None and value / limit > worst[0]:
                    name = f"{robot.name}/{joint.name} at the begin of {after.phase}"
                    worst = value / limit, name, scale * value, scale * limit, f"{unit}/s2"
    share, name, value, allowed, unit = worst
    verdict = "keeps its acceleration limit" if share <= 1.0 else "exceeds its acceleration limit"
    message = f"where phases meet: joint {name} {verdict}: {value:.4g} {unit}, limit {allowed:.5g} {unit}"
    message = message if name else "where phases meet: no joint has an acceleration limit"
    kind = "joint_acceleration_between_phases"
    return Check(kind, name, share <= 1.0, message, value=value, limit=allowed, unit=unit, at_s=0.0)


def with_joins(cell: Cell, reports: Sequence[Report]) -> list[Report]:
    """The reports of the phases of a program from home to home, the first with the check of the rows that they share.

    Args:
        cell: The cell of the whole program; reports of any other program stay as they are.
    """
    if not cell.program.is_home_to_home:
        return list(reports)
    first, *others = with_via_points(cell, reports)
    return [replace(first, checks=(*first.checks, check_joins(cell, reports))), *others]
