"""A format that is no text: it rounds rows as files do, for tests of what is judged of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cellplan.model.report.exported import ExportFrame, ExportJob, Interpolation, ProgramRows, Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import from_numbers, to_numbers


def dialect(
    *, decimals: int = 6, interpolation: Interpolation = Interpolation.LINEAR, is_thinned: bool = False
) -> Dialect:
    """A format of which only the properties count."""
    return Dialect(
        name="plain",
        title="rows as they are",
        render=lambda job: {},
        read=lambda frame, files: (),
        decimals=decimals,
        promises=(Promise.TIMED, Promise.SEQUENCE_ONLY),
        interpolation=interpolation,
        is_thinned=is_thinned,
    )


def job_of(run: VerifiedRun, programs: Sequence[ProgramRows], *, promise: Promise = Promise.TIMED) -> ExportJob:
    """What a format would be given."""
    frame = ExportFrame(
        cell=run.cell,
        robots=tuple(programs[0].robots),
        programs=tuple(program.name for program in programs),
        promise=promise,
    )
    return ExportJob(frame=frame, programs=tuple(programs))


def read_back(job: ExportJob, *, decimals: int, with_times: bool = True) -> tuple[ProgramRows, ...]:
    """What a reader finds: rows rounded to decimals of a degree or millimetre, times to a microsecond."""
    programs = []
    for program in job.programs:
        robots = {}
        for name, rows in program.robots.items():
            robot = job.frame.robot(name)
            q = from_numbers(robot, to_numbers(robot, rows.q, decimals=decimals))
            times = np.round(rows.times, 6) if with_times and rows.times is not None else None
            robots[name] = replace(rows, q=q, times=times)
        programs.append(replace(program, robots=robots))
    return tuple(programs)
