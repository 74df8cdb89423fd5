"""Feeds that the file of a path states, as the speeds and times of stretches between its stops."""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import chord_lengths
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.pace import Pace
from cellplan.model.task.task import ProgrammedPath, Task
from cellplan.model.task.toolpath import Toolpath

LENGTH_TOL = 1e-12  # [-] of a length by which ramps may be longer than their stretch: rounding
REST_RAMP = 0.25  # [-] of the time of a rest: any share does, nothing moves


def pace_of(task: Task, path: ProgrammedPath, toolpath: Toolpath) -> tuple[Array, Array, Pace]:
    r"""Speeds of a path whose file states feeds.

    A stretch ends at each stop and where the feed changes. It is passed at its feed ``f`` but for the ramps at its
    ends, each of which takes the time ``r``, on a run that of all its length, from a speed ``a`` and to a speed ``b``:
    zero at stops, else the slower one of both feeds, so that a slower feed holds on all of its stretch. With the length
    ``L`` it takes

    .. math:: T = L/f + r (1 - a/f)/2 + r (1 - b/f)/2

    Where a stretch is too short for its ramps the tool stops at both of its ends, and its top speed is ``L/r``. The
    delays of the process are rests at its inner ends.

    Returns:
        Times in [s] between the stretches, shape (S + 1,), lengths of path in [m] behind these, and their speeds.
    """
    process = task.process or ProcessEntry()
    given, ramp = chord_lengths(path.listed.points), np.asarray(process.ramp)
    is_stop = np.isin(given, toolpath.stops)
    changes = (np.diff(path.speeds) != 0.0) | np.diff(path.is_on)
    nodes = np.flatnonzero(is_stop | np.append(False, np.append(changes, False)))
    behind, feeds, is_on = toolpath.arc.lengths(given[nodes]), path.speeds[nodes[:-1]], path.is_on[nodes[:-1]]
    lengths = np.diff(behind)
    if path.is_run is not None:
        ramp = np.where(path.is_run[nodes[:-1]], 2.0 * lengths / feeds, ramp)
    slower = np.append(feeds[0], np.append(np.minimum(feeds[:-1], feeds[1:]), feeds[-1]))
    ends = np.where(is_stop[nodes], 0.0, slower)
    while True:
        at = np.stack([ends[:-1], ends[1:]])
        needed = 0.5 * ramp * np.where(at < feeds, feeds + at, 0.0).sum(axis=0)
        is_short = needed > lengths * (1.0 + LENGTH_TOL)
        standing = np.append(is_short, False) | np.append(False, is_short)
        if not np.any(ends[standing]):
            break
        ends = np.where(standing, 0.0, ends)
    tops = np.where(is_short, lengths / ramp, feeds)
    drops = 1.0 - at.T / tops[:, None]
    times = lengths / tops + 0.5 * ramp * drops.sum(axis=1)
    switches = np.flatnonzero(np.diff(is_on)) + 1  # stretches before which the process is switched
    delays = np.where(is_on[switches], process.on_delay_s, process.off_delay_s)
    places = switches[delays > 0.0]
    times = np.insert(times, places, delays[delays > 0.0])
    is_rest = np.insert(np.zeros(len(tops), dtype=bool), places, True)
    pieces = np.cumsum(is_stop)[nodes[:-1]] - 1
    pace = Pace(
        pieces=np.insert(pieces, places, pieces[places]),
        tops=np.insert(tops, places, 0.0),
        drops=np.insert(drops, places, 1.0, axis=0),
        ramps=np.where(is_rest, REST_RAMP, ramp / times),
        is_on=np.insert(is_on, places, True),
        is_at_feed=np.insert(is_on & ~is_short, places, False),
    )
    corners = task.moves_from + np.append(0.0, np.cumsum(times))
    return corners, np.insert(behind, places, behind[places]), pace
