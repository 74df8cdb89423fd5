"""Via points: whether transfer moves pass, at rows and in their order, what tasks state before and after them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.report import Check, Report
from cellplan.model.task.task import Service, ViaPoint, configuration_of

PASSED: Final = 1e-9  # [rad] or [m] within which a configuration is passed: rounding of the tables


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
