"""Feeds of tools whose rows are poses on the part at stated times: for whom they hold, and who goes slower."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.report.exported import ProgramRows
from cellplan.programs.rows.rows import EssentialRows, times_of

HELD: Final = 0.01  # [-] of a feed by which it may be missed: a chord is shorter than a curved path
STANDS: Final = 1e-9  # [m] a tool that moves less stands
SAME_TIME: Final = 1e-7  # [s] rows nearer than this are one


def feeds_in_step(
    programs: Sequence[ProgramRows], full: Sequence[ProgramRows], essential: Sequence[EssentialRows]
) -> Iterator[str]:
    """What the head says of the feeds of robots in step.

    Args:
        programs: Rows that are written, at common times.
        full: All rows of the programs.
        essential: The phases of the programs.
    """
    passed: dict[str, list[Array]] = {}  # by robot, speeds as shares of the feed, and lengths in [m], shape (2, M) each
    for program, every, phases in zip(programs, full, essential, strict=True):
        for phase in phases.work:
            for task in map(phase.cell.task, phase.tasks):
                rows = program.robots.get(task.robot)
                if (
                    task.feed is None
                    or not task.has_one_feed
                    or rows is None
                    or rows.X_PT is None
                    or rows.process is None
                ):
                    continue
                times, clock = times_of(rows), times_of(every.robots[task.robot])[phase.rows]
                is_on = rows.process[:-1] & (times[:-1] >= clock[0] - SAME_TIME) & (times[1:] <= clock[-1] + SAME_TIME)
                lengths = np.linalg.norm(np.diff(rows.X_PT[:, :3, 3], axis=0), axis=1)
                steps = np.stack([lengths / (np.diff(times) * task.feed), lengths])
                passed.setdefault(task.robot, []).append(steps[:, is_on & np.isfinite(lengths)])
    for name, parts in passed.items():
        shares, lengths = np.concatenate(parts, axis=1)
        covered = float(lengths[shares >= 1.0 - HELD].sum() / max(lengths.sum(), STANDS))
        if covered < 1.0:
            least = f", and goes down to {shares.min():.0%}"
            yield f"at the stated times the tool of '{name}' has its feed on {covered:.0%} of its way in process{least}"
        elif shares.size:
            yield f"at the stated times the feed on the part holds for the tool of '{name}'"
