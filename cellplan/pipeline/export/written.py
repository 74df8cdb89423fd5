"""Written: the files of an export, read back by the reader of their format and judged as they were read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NotVerifiedError
from cellplan.model.exported import ExportJob, ProgramRows, RobotRows, Targets
from cellplan.model.progress import Progress, silent
from cellplan.model.verified_run import VerifiedRun
from cellplan.pipeline.export.judge import Judgement, judge
from cellplan.pipeline.export.notes import export_notes
from cellplan.pipeline.export.orders import certify_written
from cellplan.pipeline.export.part_targets import joints_of_part_poses
from cellplan.pipeline.export.prepare import Prepared

STAGE: Final = "checking what was written"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Written:
    """The files of an export.

    Attributes:
        job: What was written, with its notes.
        files: Text by path.
        judgement: What was found in what was read back.
    """

    job: ExportJob
    files: dict[str, str]
    judgement: Judgement


def write(run: VerifiedRun, prepared: Prepared, *, progress: Progress = silent) -> Written:
    """Render the files of an export, read them back, and judge what was read; then say so in their heads.

    Args:
        run: The run.
        prepared: What is to be written.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: Something cannot be written in this format.
        NotVerifiedError: A check fails on what was read.
    """
    read = read_files(prepared, prepared.dialect.render(prepared.job))
    written = with_notes(run, prepared, judged(run, prepared, read, progress=progress))
    if not same_rows(read, read_files(prepared, written.files)):
        raise InputError(f"{prepared.dialect.name}: expected the same rows with notes in the files as without")
    return written


def with_notes(run: VerifiedRun, prepared: Prepared, judgement: Judgement) -> Written:
    """The files of an export that say in their heads what was found in them.

    Args:
        run: The run.
        prepared: What is to be written.
        judgement: What was found in what was read back.
    """
    job = replace(prepared.job, notes=export_notes(run, prepared, judgement))
    return Written(job=job, files=prepared.dialect.render(job), judgement=judgement)


def read_files(prepared: Prepared, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """What the reader of the format finds in files.

    Raises:
        InputError: With file and line, where a text is none of this format.
    """
    return prepared.dialect.read(prepared.job.frame, files)


def judged(
    run: VerifiedRun, prepared: Prepared, read: tuple[ProgramRows, ...], *, progress: Progress = silent
) -> Judgement:
    """Make all checks on what was read.

    Args:
        run: The run.
        prepared: What was to be written.
        read: What was read.
        progress: Called with the stage and the fraction done.

    Raises:
        NotVerifiedError: A check fails.
    """
    if prepared.job.frame.targets is Targets.PART:
        read = joints_of_part_poses(prepared.job.frame, prepared.job.programs, read)
    progress(STAGE, 0.0)
    found = judge(run, prepared.dialect, prepared.job, read, lead=prepared.lead, shared=prepared.shared)
    progress(STAGE, 1.0)
    findings = list(found.findings)
    if not findings and prepared.orders:
        findings += certify_written(run, prepared.orders, read, progress=progress)
    if findings:
        raise NotVerifiedError(findings)
    return found


def same_rows(one: Sequence[ProgramRows], other: Sequence[ProgramRows]) -> bool:
    """Whether two readings of programs are equal to the last bit."""
    return len(one) == len(other) and all(
        mine.name == yours.name
        and list(mine.robots) == list(yours.robots)
        and all(_same(mine.robots[name], yours.robots[name]) for name in mine.robots)
        for mine, yours in zip(one, other, strict=True)
    )


def _same(one: RobotRows, other: RobotRows) -> bool:
    """Whether the rows of a robot are equal."""
    pairs = [
        (one.X_PT, other.X_PT),
        (one.q, other.q),
        (one.times, other.times),
        (one.qd, other.qd),
        (one.process, other.process),
        (one.rounding, other.rounding),
    ]
    return one.marks == other.marks and all(
        (a is None and b is None)
        or (a is not None and b is not None and np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
        for a, b in pairs
    )
