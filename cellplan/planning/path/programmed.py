"""Paths of CAM: straight sides with rounded corners, and stops where they are sharp or the process is switched."""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import BezierCurve, chord_lengths, rounded_lines, turns
from cellplan.model.task.task import ProgrammedPath
from cellplan.planning.path.curve import STRAIGHT_ON, PathCurve


def programmed_curve(path: ProgrammedPath) -> PathCurve:
    """Straight sides that stop at sharp corners and where the process is switched, all other corners rounded."""
    given, is_stop = chord_lengths(path.listed.points), np.concatenate([[True], path.inner_stops, [True]])
    curve = with_programmed_corners(path, path.points)
    return PathCurve(curve=curve, stops=given[is_stop], given=given, is_closed=False)


def with_programmed_corners(path: ProgrammedPath, values: Array) -> BezierCurve:
    """Values at the points of a path, shape (N, 3), linear over its length but for the roundings of its corners.

    A corner is rounded as `rounded_sides` does it, from as far before it as keeps the tip within ``path.rounding`` of
    the corner, at most from the middle of the shorter side.
    """
    given = chord_lengths(path.listed.points)
    width = np.diff(given)
    change = 2.0 * np.sin(0.5 * turns(path.listed.points))  # length of the change of direction
    within = 4.0 * path.rounding / np.maximum(change, STRAIGHT_ON)
    blends = np.minimum(within, 0.5 * np.minimum(width[:-1], width[1:]))
    blends[path.inner_stops] = 0.0
    return rounded_lines(given, values, np.diff(values, axis=0) / width[:, None], blends)
