"""Clearance: contacts and smallest distances of the bodies of a cell at any time of a motion."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.certify.bound import Bound, PairBound
from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import scene_of_run, with_straight_move
from cellplan.certify.survey import CLOSEST_COUNT
from cellplan.checks.clearance.contacts import EXACT_TOL, clearance_check, collision_checks, find_contacts, time_of
from cellplan.geometry.arrays import Array
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Check, ClearanceClass, ClearanceMinimum, ClearanceReport, ClosePair
from cellplan.scene.scene import Scene

STAGE: Final = "checking clearance"
CERTIFY_FRACTION: Final = 0.9  # [-] of the stage: the certificate
UNKNOWN: Final = ClearanceReport(
    minima={}, contacts=(), exclusions=(), pair_count=0, curve_times=np.empty(0), curves={}
)  # before anything was checked


def check_clearance(
    scene: Scene, schedule: Schedule, q: Array, *, with_curves: bool = True, progress: Progress = silent
) -> tuple[ClearanceReport, tuple[Check, ...]]:
    """Find every contact and the smallest distance of each class, at the samples of a motion and between them.

    Between two samples every joint moves linearly. What is reported then holds at all times. That the demanded distance
    is kept is proved first; where it cannot be the pair is "not certified", which fails the check. The smallest
    distance is searched for afterwards; where that takes too much work a lower bound of it is reported.

    The tool of a robot whose task is scheduled may touch the part within ``checks.contact_zone_mm`` of its tip, during
    the whole motion: before its start and after its end it dwells on the part. Such contacts are listed as allowed, and
    that pair is excluded from the clearance requirement. The part of the tool outside the zone must not touch. Robots
    whose tasks are not scheduled are idle and keep away from everything, the part too.

    Args:
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        with_curves: Whether the distances over time are worked out sharply enough to be drawn; see ``certify``.

    Returns:
        The distances, never above the truth and within 0.1 mm of it unless they are said not to be exact, and a verdict
        on each class.
    """
    scene = scene_of_run(scene, [scheduled.task.name for scheduled in schedule.tasks])
    queries = replace(scene.engine.queries)
    judged, times, q = with_straight_move(scene, schedule.times, q)
    bound = certify(
        judged, q, with_curves=with_curves, progress=lambda fraction: progress(STAGE, CERTIFY_FRACTION * fraction)
    )
    contacts = find_contacts(bound, times)
    minima = {kind: _minimum(bound, times, kind) for kind in ClearanceClass}
    curve_times, curves = _curves(bound, times, minima)
    report = ClearanceReport(
        minima=minima,
        contacts=contacts,
        exclusions=(*scene.exclusions, *_stated(bound)),
        pair_count=len({(pair.pair.first, pair.pair.second) for pair in bound.pairs}),
        curve_times=curve_times,
        curves=curves,
        closest=_closest(bound, times),
        not_certified=tuple(bound.names(pair) for pair in bound.pairs if pair.is_open),
        distance_queries=scene.engine.queries.distances - queries.distances,
        contact_queries=scene.engine.queries.contacts - queries.contacts,
        cut_steps=sum(pair.cuts for pair in bound.pairs),
        left_out=scene.left_out,
    )
    classes = [kind for kind in ClearanceClass if bound.of_class(kind)]
    checks = [check for kind in classes for check in collision_checks(bound, contacts, times, kind=kind)]
    known = [kind for kind in classes if minima[kind].minimum is not None and minima[kind].certified]
    checks += [clearance_check(bound, times, kind, minima[kind]) for kind in known]
    progress(STAGE, 1.0)
    return report, tuple(checks)


def _minimum(bound: Bound, times: Array, kind: ClearanceClass) -> ClearanceMinimum:
    """Smallest distance of a class: zero where one of its pairs touches, a lower bound where no more is proved."""
    watched = bound.of_class(kind)
    touching = [pair for pair in watched if pair.touches]
    if touching:
        pair = min(touching, key=lambda pair: min(pair.touches))
        return ClearanceMinimum(
            minimum=0.0,
            pair=bound.names(pair),
            at_s=time_of(times, min(pair.touches)),
            certified=True,
            accuracies=_accuracies(bound, pair),
        )
    candidates = [pair for pair in watched if pair.is_compared or pair.is_open]
    if not candidates:
        return ClearanceMinimum()
    is_certified = not any(pair.is_open for pair in watched)
    proved = min(pair.lowest for pair in candidates)
    pair = min(candidates, key=lambda pair: pair.distance)
    is_exact = is_certified and pair.distance - proved <= EXACT_TOL
    if not is_exact:
        pair = min(candidates, key=lambda pair: pair.lowest)
    points = bound.nearest_points(pair)
    return ClearanceMinimum(
        minimum=max(0.0, min(pair.distance, proved)),
        pair=bound.names(pair),
        at_s=time_of(times, pair.at),
        certified=is_certified,
        exact=is_exact,
        points=None if points is None else (_point(points[0]), _point(points[1])),
        accuracies=_accuracies(bound, pair),
    )


def _accuracies(bound: Bound, pair: PairBound) -> tuple[float | None, float | None]:
    """How far the real things may stick out of the two bodies of a pair, in [m]; None where it is not stated."""
    bodies = bound.scene.bodies
    return bodies[pair.pair.first].accuracy, bodies[pair.pair.second].accuracy


def _point(p: Array) -> tuple[float, float, float]:
    """A point as plain numbers."""
    return float(p[0]), float(p[1]), float(p[2])


def _closest(bound: Bound, times: Array) -> tuple[ClosePair, ...]:
    """The closest pairs of the cell, nearest first; those that touch have the distance 0."""
    known = (pair for pair in bound.pairs if pair.is_compared and np.isfinite(pair.nearest))
    return tuple(
        ClosePair(
            pair=bound.names(pair),
            clearance_class=pair.pair.clearance_class,
            distance=pair.proved,
            at_s=time_of(times, min(pair.touches, default=pair.at)),
        )
        for pair in sorted(known, key=lambda pair: pair.nearest)[:CLOSEST_COUNT]
    )


def _curves(
    bound: Bound, times: Array, minima: Mapping[ClearanceClass, ClearanceMinimum]
) -> tuple[Array, Mapping[ClearanceClass, Array]]:
    """Times of the plotted curves in [s], and the distance that each class keeps in the block of each of them.

    Plotted are the middle of each block, both ends of the program, and the times of the minima.
    """
    ends = times[bound.edges]
    plotted = [0.5 * (ends[1:] + ends[:-1]), ends[[0, -1]]]
    plotted.append(np.array([minimum.at_s for minimum in minima.values() if minimum.at_s is not None]))
    curve_times = np.unique(np.concatenate(plotted))
    block = np.clip(np.searchsorted(ends, curve_times, side="right") - 1, 0, len(ends) - 2)
    curves = {}
    for kind in ClearanceClass:
        watched = bound.of_class(kind)
        if any(pair.is_compared for pair in watched):
            shown = [pair for pair in watched if pair.is_compared or pair.touches or pair.unproved]
            curves[kind] = np.maximum(bound.lowest_bounds(shown), 0.0)[block]
    return curve_times, curves


def _stated(bound: Bound) -> list[tuple[str, str, str]]:
    """Pairs of which less is demanded than the full clearance, with the reason."""
    return [(*bound.names(pair), pair.pair.reason) for pair in bound.pairs if pair.pair.reason]
