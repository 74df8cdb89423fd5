"""Export jobs of a verified run, with all of its rows and robots."""

from cellplan.model.report.exported import ExportFrame, ExportJob, Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.rows.rows import full_rows


def job_of_run(run: VerifiedRun, *, promise: Promise = Promise.TIMED) -> ExportJob:
    """The job of all rows of all robots."""
    robots = tuple(robot.name for robot in run.cell.robots)
    frame = ExportFrame(cell=run.cell, robots=robots, programs=tuple(run.programs), promise=promise)
    return ExportJob(frame=frame, programs=full_rows(run))
