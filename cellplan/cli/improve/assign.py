"""``cellplan assign``: who does which task, in which order, in which direction and at which pose of the part."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cellplan.cli.options.request import Options, option
from cellplan.cli.options.shared import AllowDirs, AsJson, CellFile, Quiet, ResumeSearch, Settings
from cellplan.cli.terminal.errors import resumable
from cellplan.cli.terminal.output import Result
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class AssignOptions(Options):
    """Whose tasks are assigned."""

    SCHEMA = "cellplan.assignment/1"

    cell: CellFile
    output: Annotated[
        Path | None, option("-o, --output DIR", "Folder (default: outputs/NAME-assign, NAME that of the cell).")
    ] = None
    settings: Settings = ()
    effort: Annotated[int, option("--effort N", "Work of the solver: 1 quick, 2 usual, 5 very long.", min=1, max=5)] = 2
    stations: Annotated[
        int | None,
        option("--stations N", "Poses of the part in use at most, instead of assign.most_stations.", min=1, max=40),
    ] = None
    only_bound: Annotated[
        bool, option("--only-bound", "Stop after the block model: a lower bound of the cycle, and no program.")
    ] = False
    with_view: Annotated[bool, option("--view", "Write the 3-D page of the program too, run/view.html.")] = False
    resume: ResumeSearch = False
    as_json: AsJson = False
    quiet: Quiet = False
    allow_dirs: AllowDirs = ()


def assign(options: AssignOptions) -> Result:
    """Choose for every task the robot, the block, the direction, the spin and the pose of the part.

    Tasks with robot: any, or a list of robots, are open; what is given is kept. The result, best.yaml, is solved and
    verified from home to home, and stated with a lower bound of the cycle. Where a robot is not available, tasks that
    no other one can do are left out, with exit status 1. Exit status: 0 passed every check, 1 a check failed, 2 bad
    input, 3 a task that no robot can do or no program, 4 internal error, 130 interrupted (--resume goes on).
    """
    from cellplan.jobs.assign.assign import assign as assigned
    from cellplan.jobs.assign.assign import assignment_bound
    from cellplan.jobs.assign.draft import AssignmentDraft
    from cellplan.jobs.assign.result import assign_lines, bound_lines, bound_record
    from cellplan.jobs.assign.write import recorded_assignment, write_assignment, write_bound
    from cellplan.jobs.view.write import write_view_of_run

    draft = AssignmentDraft.load(options.cell, allow_dirs=options.allow_dirs, settings=options.settings)
    folder = options.output or Path("outputs") / f"{draft.cell.name}-assign"
    choice: Any = {"effort": options.effort, "stations": options.stations}
    recorded = recorded_assignment(
        draft, folder, settings=options.settings, resume=options.resume, **choice, only_bound=options.only_bound
    )
    with progress_listener(quiet=options.quiet) as progress, resumable(), recorded as answers:
        if options.only_bound:
            of_bound = bound_record(assignment_bound(draft, **choice, progress=progress, answers=answers))
            write_bound(of_bound, folder, journal=answers.file.read_bytes())
            about: dict[str, object] = {"exit": int(ExitStatus.PASSED), "folder": str(folder)}
            return Result(ExitStatus.PASSED, bound_lines(of_bound), {**of_bound, **about})
        assignment = assigned(draft, **choice, progress=progress, answers=answers)
        journal = answers.file.read_bytes()
        record = write_assignment(assignment, options.cell, folder, journal=journal, progress=progress)
        if options.with_view:
            write_view_of_run(folder / "run", assignment.cell, progress=progress)
    status = ExitStatus.PASSED if assignment.passed else ExitStatus.CHECK_FAILED
    about = {"exit": int(status), "folder": str(folder), "report_path": str(folder / "assign.html")}
    lines = [*assign_lines(record), f"cell: {folder / 'best.yaml'}", f"report: {folder / 'assign.html'}"]
    return Result(status, lines, {**record, **about})
