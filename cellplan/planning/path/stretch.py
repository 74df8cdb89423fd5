"""Stretches of a path: from one place to another, backwards, past its start, and back at its end."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.arc_length import measure
from cellplan.geometry.curves.rerun import Rerun, RerunCurve, RerunSeam
from cellplan.model.task.seam import Stretch
from cellplan.model.task.task import Task
from cellplan.planning.path.curve import PathCurve
from cellplan.planning.path.formatting import length

SAME_LENGTH: Final = 1e-9  # [m] lengths that differ by less are one: rounding


def stretch_of(path: PathCurve, stretch: Stretch, task: Task) -> Rerun:
    """The part of a path that a task runs along.

    Raises:
        InputError: It is not on the path, or the path has no start to go past.
    """
    arc = measure(path.curve)
    first, last = float(path.curve.knots[0]), float(path.curve.knots[-1])
    begin, end = stretch.begin, arc.total if stretch.end is None else stretch.end
    for key, value in (("from_mm", begin), ("to_mm", end), ("overlap_mm", stretch.overlap)):
        if value > arc.total + SAME_LENGTH:
            raise InputError(
                f"{task.where(f'path.{key}')}: expected at most {length(arc.total)} mm, the length of the path, got "
                f"{length(value)}"
            )
    if not end - begin > SAME_LENGTH:
        raise InputError(
            f"{task.where('path.to_mm' if stretch.end is not None else 'path.from_mm')}: expected an end behind the "
            f"begin, got {length(begin)} to {length(end)} mm of {length(arc.total)} mm"
        )
    if stretch.overlap and not path.is_closed:
        raise InputError(f"{task.where('path.overlap_mm')}: expected a closed path, got one with two ends")
    places = arc.parameters(np.array([begin, min(end, arc.total), stretch.overlap]), (first, last))
    pieces = [(float(places[0]), last if end >= arc.total - SAME_LENGTH else float(places[1]))]
    if stretch.overlap and not stretch.is_reversed:
        pieces.append((first, float(places[2])))
    if stretch.is_reversed:
        pieces = [(b, a) for a, b in pieces]
        if stretch.overlap:
            place = arc.parameters(np.array([arc.total - stretch.overlap]), (first, last))
            pieces.append((last, float(place[0])))
    starts, ends = np.array(pieces).T
    return Rerun(starts=starts, ends=ends)


def back_at_end(path: PathCurve, distance: float, task: Task) -> Rerun:
    """All of a path, and back along it by a distance in [m].

    Raises:
        InputError: The path is shorter.
    """
    arc = measure(path.curve)
    first, last = float(path.curve.knots[0]), float(path.curve.knots[-1])
    if distance > arc.total:
        raise InputError(
            f"{task.where('path.back_mm')}: expected at most {length(arc.total)} mm, the length of the path, got "
            f"{length(distance)}"
        )
    place = float(arc.parameters(np.array([arc.total - distance]), (first, last))[0])
    return Rerun(starts=np.array([first, last]), ends=np.array([last, place]))


def along_stretches(path: PathCurve, rerun: Rerun) -> PathCurve:
    """A path along its stretches, with its stops in them; where it turns round it stops."""
    edges, signs = rerun.edges, rerun.signs
    whole = abs(rerun.ends[0] - rerun.starts[0]) == path.curve.knots[-1] - path.curve.knots[0] and len(signs) == 1
    turns = edges[1:-1][(np.diff(signs) != 0.0) | (not path.runs_on)]
    stops: Array = np.unique(np.concatenate([edges[[0, -1]], turns, rerun.knots(path.stops)]))
    return replace(
        path,
        curve=RerunCurve(curve=path.curve, rerun=rerun),
        stops=stops,
        given=stops,
        is_closed=path.is_closed and whole,
        runs_on=path.runs_on and whole,
        seam=None if path.seam is None else RerunSeam(seam=path.seam, rerun=rerun),
        inward=None if path.inward is None else RerunCurve(curve=path.inward, rerun=rerun),
        walls={name: RerunCurve(curve=normals, rerun=rerun) for name, normals in path.walls.items()},
    )
