"""Clearance: what touches, when, and how near the bodies of a cell come to each other at any instant of a motion."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import scene_of_run
from cellplan.certify.search import survey
from cellplan.certify.survey import CLOSEST, Survey, lowest_bounds, proved_distance
from cellplan.checks.clearance.contacts import collision_checks, find_contacts, seconds, uncertified
from cellplan.checks.clearance.demanded import EXACT, demanded_clearance
from cellplan.geometry.transforms import Array
from cellplan.model.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Check, ClearanceClass, ClearanceMinimum, ClearanceReport, ClosePair
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

STAGE: Final = "checking clearance"
UNKNOWN: Final = ClearanceReport(
    minima={}, contacts=(), exclusions=(), pair_count=0, curve_times=np.empty(0), curves={}
)  # before anything was checked


def check_clearance(
    scene: Scene, schedule: Schedule, q: Array, *, progress: Progress = silent
) -> tuple[ClearanceReport, tuple[Check, ...]]:
    """Find every contact and the smallest distance of each class, at the samples of a motion and between them.

    Between two samples every joint is taken to move evenly. What is reported then holds at every instant. That the
    demanded distance is kept is proved first; where it cannot be the pair is "not certified", which fails the check.
    The smallest distance is looked for afterwards; where that takes too much work a lower bound of it is reported.

    The tool of a robot whose task is scheduled may touch the part within ``checks.contact_zone`` of its tip, from the
    first instant to the last: before its start and after its end it dwells on the part. Such contacts are listed as
    allowed, and the distance between that tool and the part is no matter of clearance. What of the tool lies outside
    the zone must not touch. Robots whose tasks are not scheduled are idle and keep away from everything, the part too.

    Args:
        scene: The cell made computable.
        schedule: The tasks and the clock.
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        progress: Who wants to know how far it is.

    Returns:
        The distances, never above the truth and within 0.1 mm of it unless they are said not to be exact, and a verdict
        on each class.
    """
    scene = scene_of_run(scene, [scheduled.task.name for scheduled in schedule.tasks])
    rows = range(len(scene.pairs))
    asked = replace(scene.engine.asked)
    found = survey(scene, q, progress=progress, stage=STAGE)
    contacts, open_rows = find_contacts(found, schedule.times), uncertified(found)
    minima = {kind: _minimum(found, schedule.times, kind, open_rows=open_rows) for kind in ClearanceClass}
    curve_times, curves = _curves(found, schedule.times, minima)
    report = ClearanceReport(
        minima=minima,
        contacts=contacts,
        exclusions=(*scene.exclusions, *_stated(scene, rows)),
        pair_count=len(rows),
        curve_times=curve_times,
        curves=curves,
        closest=_closest(found, schedule.times),
        not_certified=tuple(scene.names(scene.pairs[row]) for row in open_rows),
        distance_queries=scene.engine.asked.distances - asked.distances,
        contact_queries=scene.engine.asked.contacts - asked.contacts,
        cut_steps=sum(pair.cuts for pair in found.found),
        left_out=scene.left_out,
    )
    classes = [kind for kind in ClearanceClass if any(scene.pairs[row].clearance_class is kind for row in rows)]
    checks = [
        check
        for kind in classes
        for check in collision_checks(found, contacts, schedule.times, kind=kind, open_rows=open_rows)
    ]
    known = [kind for kind in classes if minima[kind].minimum is not None and minima[kind].certified]
    checks += [demanded_clearance(found, schedule.times, kind, minima[kind]) for kind in known]
    progress(STAGE, 1.0)
    return report, tuple(checks)


def _minimum(seen: Survey, times: Array, kind: ClearanceClass, *, open_rows: Sequence[int]) -> ClearanceMinimum:
    """Smallest distance of a class: zero where one of its pairs touches, a lower bound where no more is proved."""
    pairs, rows = seen.scene.pairs, seen.rows(kind)
    watched = seen.watched(kind)
    touching = [(min(seen.found[row].touches), row) for row in watched if seen.found[row].touches]
    if touching:
        at, row = min(touching)
        return ClearanceMinimum(
            minimum=0.0,
            pair=seen.scene.names(pairs[row]),
            at_s=_second(times, at),
            certified=True,
            accuracies=_accuracies(seen, row),
        )
    unproved = [row for row in watched.tolist() if row in open_rows]
    rows = np.union1d(rows, np.array(unproved, dtype=np.intp))
    if not len(rows):
        return ClearanceMinimum()
    proved = float(lowest_bounds(seen, rows).min())
    row = min(rows.tolist(), key=lambda row: seen.found[row].distance)
    is_exact = not unproved and seen.found[row].distance - proved <= EXACT
    if not is_exact:
        row = min(rows.tolist(), key=lambda row: float(seen.low[row].min()))
    found, points = seen.found[row], seen.nearest_points(row)
    return ClearanceMinimum(
        minimum=max(0.0, min(found.distance, proved)),
        pair=seen.scene.names(pairs[row]),
        at_s=_second(times, found.at),
        certified=not unproved,
        exact=is_exact,
        points=None if points is None else (_point(points[0]), _point(points[1])),
        accuracies=_accuracies(seen, row),
    )


def _second(times: Array, at: float) -> float:
    """Instant in [s] from one counted in samples."""
    return float(seconds(times, np.array([at]))[0])


def _accuracies(seen: Survey, row: int) -> tuple[float | None, float | None]:
    """How good the two bodies of a pair are, in [m]; None where it is not stated."""
    scene, pair = seen.scene, seen.scene.pairs[row]
    return scene.bodies[pair.first].accuracy, scene.bodies[pair.second].accuracy


def _point(p: Array) -> tuple[float, float, float]:
    """A point as plain numbers."""
    return float(p[0]), float(p[1]), float(p[2])


def _closest(seen: Survey, times: Array) -> tuple[ClosePair, ...]:
    """The closest pairs of the cell, nearest first; those that touch have the distance 0."""
    pairs = seen.scene.pairs
    rows = sorted(seen.known(), key=lambda row: (seen.distance(row), row))[:CLOSEST]
    return tuple(
        ClosePair(
            pair=seen.scene.names(pairs[row]),
            clearance_class=pairs[row].clearance_class,
            distance=proved_distance(seen, row),
            at_s=float(seconds(times, np.array([min(seen.found[row].touches, default=seen.found[row].at)]))[0]),
        )
        for row in rows
    )


def _curves(
    seen: Survey, times: Array, minima: Mapping[ClearanceClass, ClearanceMinimum]
) -> tuple[Array, Mapping[ClearanceClass, Array]]:
    """Instants of the plotted curves in [s] and what each class keeps in the block of each of them.

    Plotted are the middle of each block, both ends of the program, and the instants of the minima.
    """
    ends = times[seen.edges]
    instants = [0.5 * (ends[1:] + ends[:-1]), ends[[0, -1]]]
    instants.append(np.array([found.at_s for found in minima.values() if found.at_s is not None]))
    curve_times = np.unique(np.concatenate(instants))
    block = np.clip(np.searchsorted(ends, curve_times, side="right") - 1, 0, len(ends) - 2)
    curves = {}
    for kind in ClearanceClass:
        rows = seen.rows(kind)
        if len(rows):
            touched = [row for row in seen.watched(kind) if seen.found[row].touches or seen.found[row].unproved]
            kept = lowest_bounds(seen, np.append(rows, np.array(touched, dtype=np.intp)))
            curves[kind] = np.maximum(kept, 0.0)[block]
    return curve_times, curves


def _stated(scene: Scene, rows: Sequence[int]) -> list[tuple[str, str, str]]:
    """Pairs of which less is asked than the full clearance, with the reason."""
    return [
        (*scene.names(scene.pairs[row]), scene.pairs[row].reason)
        for row in rows
        if scene.pairs[row].rule is not Rule.CLEARANCE
    ]
