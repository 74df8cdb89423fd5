"""Joints of a whole program: accelerations at rows in which phases meet, and via points that transfer moves pass."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.joint_limits import acceleration_limit
from cellplan.model.report.report import Check, Report
from cellplan.model.task.task import Service, ViaPoint, configuration_of

PASSED: Final = 1e-9  # [rad] or [m] within which a configuration is passed: rounding of the tables


def check_joins(cell: Cell, reports: Sequence[Report]) -> Check:
    """The largest acceleration of a joint at a row that two phases share, against its limit.

    At such a row the acceleration is the change of velocity from the step before it to the step after it, over a step.
    Each phase by itself is judged as if joints rested beside it.

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


def with_via_points(cell: Cell, reports: Sequence[Report]) -> list[Report]:
    """The reports of the phases of one cycle with the checks of their via points."""
    checks = (_checks(cell, reports, place) for place in range(len(reports)))
    return [replace(report, checks=(*report.checks, *more)) for report, more in zip(reports, checks, strict=True)]


def _checks(cell: Cell, reports: Sequence[Report], place: int) -> Iterator[Check]:
    """One check for each robot with via points in a transfer move: without tasks, the first phase or after some."""
    if reports[place].tasks or (place and not reports[place - 1].tasks):
        return
    last = reports[place - 1].tasks if place else ()
    following = next((report.tasks for report in reports[place + 1 :] if report.tasks), ())
    via: dict[str, list[ViaPoint]] = {}
    for name in (*last, *following):
        task = next(
            (task for task in cell.tasks if task.name == name), None
        )  # moves of the part are no tasks of a cell
        if task is not None:
            via.setdefault(task.robot, []).extend(task.via_after if name in last else task.via_before)
    for name, points in via.items():
        if points:
            yield _check(cell.robot(name), reports[place], points)
        for service in (it for it in points if isinstance(it, Service)):
            yield _stay(name, reports[place], service)


def _check(robot: Robot, report: Report, points: Sequence[ViaPoint]) -> Check:
    """How far a robot is from the via point that it misses most; each is looked for from where it passes the last."""
    worst, at_s, first, q = 0.0, 0.0, 0, report.q[robot.name]
    for point in points:
        at = configuration_of(point, np.asarray(robot.home))
        apart = np.abs(q[first:] - at).max(axis=1)
        passing = np.flatnonzero(apart <= PASSED)
        row = first + int(passing[0] if len(passing) else np.argmin(apart))
        if apart[row - first] > worst:
            worst, at_s = float(apart[row - first]), float(report.times[row])
        first = row if len(passing) else first
    passed = worst <= PASSED
    verdict = "passes its via points" if passed else f"misses a via point by {worst:.4g} rad or m"
    message = f"{robot.name} {verdict}{'' if passed else f', at {at_s:.3f} s'}"
    return Check("via_point", robot.name, passed, message, value=worst, limit=PASSED, unit="rad or m", at_s=at_s)


def _stay(robot: str, report: Report, service: Service) -> Check:
    """How long a robot stands where its tool is cleaned."""
    stands = np.abs(report.q[robot] - service.posture).max(axis=1) <= PASSED
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(int)))
    spans = [(report.times[last - 1] - report.times[first], first) for first, last in edges.reshape(-1, 2)]
    longest, first = max(spans, key=lambda it: float(it[0]), default=(0.0, 0))
    passed, value, at_s = bool(longest >= service.takes - PASSED), float(longest), float(report.times[first])
    message = f"{robot} stands for {value:.4g} s where its tool is cleaned, {service.takes:g} s are demanded"
    return Check("service", robot, passed, message, value=value, limit=service.takes, unit="s", at_s=at_s)
