"""Run every resolution method on the same cells: ``make bench-methods``, or ``python benchmarks/methods.py --help``.

Errors and joint speeds come from the joints by the same checks that judge a run; they are the same on every machine.
Cost is the processor time of following the tasks alone, without search for a start, checks or files. The methods take
turns, so that a slow minute hits all alike, and the weighted pseudo-inverse of the same run is the measure. The table
goes into the guide page between its two markers, the plot beside it.
"""

import argparse
import os
import platform
import re
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import matplotlib as mpl
import numpy as np

from cellplan import CellplanError, load_cell
from cellplan.checks.joints.limits import check_joints
from cellplan.geometry.transforms import Array
from cellplan.measures.joint_use import joint_uses
from cellplan.measures.tool_errors import part_poses, task_accuracy
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.solver import NULL_SPACE_METHODS, MethodName
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths, schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

mpl.use("agg")

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/guides/which-method.md"
PLOT = ROOT / "docs/images/methods.svg"
MEASURED = re.compile(r"(?<=<!-- measured -->\n).*?(?=<!-- end -->)", re.DOTALL)
METHODS: tuple[MethodName, ...] = get_args(MethodName)
BASELINE: MethodName = "weighted_pseudo_inverse"
NOTHING = 1e-6  # [mm], [deg] or [rad/s] below which a figure says no more
LONG_S = 4.0  # [s] a run that takes longer is timed once: its length evens out the noise
COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#b8a800", "#0072b2", "#d55e00", "#cc79a7")  # Okabe and Ito
MARKERS = ("o", "P", "s", "^", "v", "D")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A cell that all methods work on.

    Attributes:
        title: What it is called in the table.
        file: The cell.
        step_s: Step of the clock in [s] in place of the cell's own; the feedback gain times the step stays as it is.
        left_out: Methods that are not run, as they would take minutes.
    """

    title: str
    file: str
    step_s: float | None = None
    left_out: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True)
class Problem:
    """All that a method is given."""

    cell: Cell
    schedule: Schedule
    start: Array
    moving: Sequence[str]


@dataclass(frozen=True, kw_only=True)
class Result:
    """What a method made of a cell.

    Attributes:
        position_mm: Largest position error of all tools after settling.
        orientation_deg: Largest orientation error after settling; None where no rotation is asked for.
        peak_rad_s: Largest joint speed after settling in [rad/s].
        peak_share: The same as a share of the joint's limit.
        keeps_limits: Whether positions, speeds and accelerations stay within the joints' limits.
        iterations: Median and largest number of evaluations per step.
    """

    position_mm: float
    orientation_deg: float | None
    peak_rad_s: float
    peak_share: float
    keeps_limits: bool
    iterations: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table: a result or a refusal, and processor time per step in [s]."""

    method: MethodName
    result: Result | None
    refusal: str
    step_cpu_s: float
    ratio: float


CASES = (
    Case(title="four robots, 1 ms", file="cells/four_robots.yaml", left_out=frozenset({"heuristic_search"})),
    Case(title="four robots, 4 ms", file="cells/four_robots.yaml", step_s=0.004),
    Case(title="planar pair", file="cells/planar_pair.yaml"),
    Case(title="Vargas II: near a singularity", file="cells/papers/vargas_case_2.yaml"),
    Case(title="Vargas III: through a singularity", file="cells/papers/vargas_case_3.yaml"),
    Case(title="Nicolato: shoulder singularity", file="cells/papers/nicolato_circle.yaml"),
)


def problem_of(case: Case) -> Problem:
    """The cell with its toolpaths on the part, its start posture found and its clock set, for Euler's steps."""
    cell = load_cell(ROOT / case.file)
    cell = replace(cell, solver=cell.solver.changed(integrator="euler"))
    if case.step_s is not None:
        gain = cell.solver.gain * cell.motion.step / case.step_s
        motion, solver = replace(cell.motion, step=case.step_s), cell.solver.changed(gain_per_s=gain)
        cell = replace(cell, motion=motion, solver=solver)
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    start = choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values())).start
    plan = plan_phases(cell).program[0]
    schedule = schedule_tasks(cell, [toolpaths[name] for name in plan.tasks])
    return Problem(cell=cell, schedule=schedule, start=start, moving=plan.moving)


def rows_of(case: Case, rounds: int) -> list[Row]:
    """All methods on one cell; they take turns."""
    problem = problem_of(case)
    chosen = [method for method in METHODS if method not in case.left_out]
    times: dict[str, list[float]] = {method: [] for method in chosen}
    outcomes: dict[str, Result | str] = {}
    for number in range(rounds):
        for method in chosen:
            if number and times[method][0] > LONG_S:
                continue
            print(f"{case.title}: {method}, round {number + 1} of {rounds}", file=sys.stderr)
            begin = time.process_time()
            outcome = followed(problem, method)
            times[method].append(time.process_time() - begin)
            if number == 0:
                outcomes[method] = outcome if isinstance(outcome, str) else judged(problem, outcome)
    costs = {method: statistics.median(time) for method, time in times.items()}
    steps = len(problem.schedule.times) - 1
    return [
        Row(
            method=method,
            result=outcome if isinstance(outcome, Result) else None,
            refusal=outcome if isinstance(outcome, str) else "",
            step_cpu_s=costs[method] / steps,
            ratio=costs[method] / costs[BASELINE],
        )
        for method in chosen
        for outcome in [outcomes[method]]
    ]


def followed(problem: Problem, method: MethodName) -> Motion | str:
    """The motion, or why there is none."""
    cell = replace(problem.cell, solver=problem.cell.solver.changed(method=method))
    try:
        return integrate_schedule(MotionTask(cell, problem.schedule, problem.moving, problem.start))
    except CellplanError as error:
        return f"{type(error).__name__}: {error}"


def judged(problem: Problem, motion: Motion) -> Result:
    """Errors, speeds and limits of a motion by the second kinematics."""
    cell, times = problem.cell, motion.times
    q = {robot.name: motion.q[:, cell.columns(robot.name)] for robot in cell.robots}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    X_WP = part_poses(cell, chains, q)
    settled = times >= max(task.task.start + task.task.settle for task in problem.schedule.tasks)
    position, orientation = 0.0, 0.0
    for task in problem.schedule.tasks:
        errors = task_accuracy(task, chains[task.task.robot], q=q[task.task.robot], X_WP=X_WP)
        position = max(position, float(np.linalg.norm(errors.position_error[settled], axis=1).max()))
        orientation = max(orientation, float(np.linalg.norm(errors.orientation_error[settled], axis=1).max()))
    turned = any(axis >= 3 for task in problem.schedule.tasks for axis in task.task.axes)
    speeds = np.abs(np.diff(motion.q, axis=0)) / np.diff(times)[:, None]
    tops = np.concatenate([robot.model.velocity for robot in cell.robots])
    checks = [
        check
        for robot in cell.robots
        for check in check_joints(joint_uses(robot, times, q[robot.name]), times, q[robot.name])
    ]
    evaluations = motion.iterations if motion.iterations is not None else np.ones(1)
    result = Result(
        position_mm=1e3 * position,
        orientation_deg=float(np.degrees(orientation)) if turned else None,
        peak_rad_s=float(speeds[settled[1:]].max()),
        peak_share=float((speeds / tops)[settled[1:]].max()),
        keeps_limits=all(check.passed for check in checks),
        iterations=(float(np.median(evaluations)), float(evaluations.max())),
    )
    figures = [position, orientation, result.peak_rad_s, result.peak_share, *result.iterations]
    if not np.all(np.isfinite(figures)) or not np.all(np.isfinite(motion.q)):
        sys.exit(f"benchmark: {cell.name}: a figure is not finite: {result}")
    return result


def table(rows: dict[str, list[Row]]) -> list[str]:
    """The table in Markdown."""
    lines = [
        "| cell | method | largest error | cost per step | × pseudo-inverse | evaluations per step | fastest joint "
        "| limits kept | secondary goals |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for title, entry in rows.items():
        for index, row in enumerate(entry):
            lead = f"| {title if index == 0 else ''} | `{row.method}` "
            cost = f"| {plain(row.step_cpu_s * 1e3, 1)} ms | {rounded(row.ratio)} "
            null_space = "yes" if row.method in NULL_SPACE_METHODS else "no"
            lines.append(f"{lead}{cells_of(row, cost)}| {null_space} |")
    return lines


def cells_of(row: Row, cost: str) -> str:
    """The cells of a row between its method and its last column."""
    result = row.result
    if result is None:
        return f"| {row.refusal} {cost}| | | "
    error = f"{plain(result.position_mm, 2)} mm"
    if result.orientation_deg is not None:
        error += f", {plain(result.orientation_deg, 1)}°"
    median, most = result.iterations
    evaluations = f"{median:g}" if median == most else f"{median:g}, at most {most:g}"
    speed = f"{plain(result.peak_rad_s, 2)} rad/s ({plain(100 * result.peak_share, 2)} %)"
    return f"| {error} {cost}| {evaluations} | {speed} | {'yes' if result.keeps_limits else '**no**'} "


def plain(value: float, digits: int) -> str:
    """A number of at least 0 with few digits and no exponent."""
    if value < NOTHING:
        return f"< {NOTHING:f}"
    places = max(digits - 1 - int(np.floor(np.log10(value))), 0)
    return f"{float(f'{value:.{digits - 1}e}'):.{places}f}"


def rounded(ratio: float) -> str:
    """A ratio with as many digits as another run would give again."""
    return f"{ratio:.1f}" if ratio < 3.0 else plain(ratio, 1)


def draw(rows: dict[str, list[Row]]) -> None:
    """Accuracy against cost per step, one mark per method and cell."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    mpl.rcParams.update({"svg.hashsalt": "cellplan", "svg.fonttype": "none", "font.size": 9})
    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    for (_, entry), marker in zip(rows.items(), MARKERS, strict=True):
        for row in entry:
            if row.result is not None:
                colour = COLOURS[METHODS.index(row.method)]
                axes.plot(
                    row.step_cpu_s * 1e3, row.result.position_mm, marker, color=colour, ms=8, mec="white", mew=0.6
                )
    axes.set(xscale="log", yscale="log", xlabel="processor time per step [ms]", ylabel="largest position error [mm]")
    axes.grid(which="major", color="#d5dae0", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    methods = [Line2D([], [], color=c, marker="o", ls="", ms=7, label=m) for m, c in zip(METHODS, COLOURS, strict=True)]
    cells = [
        Line2D([], [], color="#5f6b79", marker=m, ls="", ms=7, label=t) for t, m in zip(rows, MARKERS, strict=True)
    ]
    first = figure.legend(handles=methods, title="colour: method", loc="outside right upper", frameon=False)
    second = figure.legend(handles=cells, title="shape: cell", loc="outside right lower", frameon=False)
    for legend in (first, second):
        legend.get_title().set_fontweight("bold")
    PLOT.parent.mkdir(exist_ok=True)
    figure.savefig(PLOT, metadata={"Date": None, "Creator": "benchmarks/methods.py"})


def machine() -> str:
    """What the figures were measured on."""
    threads = "one thread" if os.environ.get("OPENBLAS_NUM_THREADS") == "1" else "as many threads as NumPy likes"
    return (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, {threads}"
    )


def main() -> None:
    """Measure, print, and write into the guide page."""
    parser = argparse.ArgumentParser(description="Run every resolution method of cellplan on the same cells.")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each method on each cell (default: 3)")
    parser.add_argument("--print", action="store_true", dest="prints_only", help="leave the guide page as it is")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    rows = {case.title: rows_of(case, options.rounds) for case in CASES}
    text = "\n".join([*table(rows), "", f"Times: medians on {machine()}.", ""])
    print(text)
    if options.prints_only:
        return
    page = PAGE.read_text(encoding="utf-8")
    if not MEASURED.search(page):
        sys.exit(f"benchmark: {PAGE.relative_to(ROOT)} has no place for the table")
    PAGE.write_text(MEASURED.sub(lambda _: f"\n{text}\n", page), encoding="utf-8")
    draw(rows)


if __name__ == "__main__":
    main()
