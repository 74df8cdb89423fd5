"""Check a cell without solving it: files, robots, paths, reach and collisions at the start; and the check as text."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from cellplan.certify.run_pairs import scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.joints.payload import check_payload_at_rest
from cellplan.checks.joints.torques import check_torques_at_rest
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.branches import MovedStart
from cellplan.model.progress import Progress, silent
from cellplan.model.report.left_out import LeftOut
from cellplan.model.report.report import Check
from cellplan.planning.modes import plan_phases, standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import first_blocks, program_stages
from cellplan.planning.start.search import StartChoice
from cellplan.planning.start.trial_motion import present_pairs
from cellplan.planning.timing.schedule import clock_paths
from cellplan.report.record.common import Record
from cellplan.report.record.sections.tasks import direction_text
from cellplan.report.text.columns import Row, aligned
from cellplan.report.text.method import moved_start_lines
from cellplan.report.text.notes import reaches_nowhere
from cellplan.report.text.run import count_text, failure_lines, left_out_lines
from cellplan.runs.plan.given_starts import with_chosen_start, with_placed_starts
from cellplan.runs.plan.program_faults import (
    refuse_hanging_parts,
    refuse_sunk_parts,
    refuse_touching_configurations,
    refuse_unnamed_supports,
)
from cellplan.runs.plan.run_reach import refuse_far_runs
from cellplan.runs.plan.start import chosen_start, depths_on_paths
from cellplan.scene.scene import Scene

MORE = "left_out of check --json"  # where the pairs stand that were not checked in full


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellCheck:
    """What can be said of a cell before it is solved."""

    cell: Cell  # the cell with every start posture filled in
    searched: tuple[str, ...]  # names of the robots whose start posture was searched for
    bulges: Mapping[str, float]  # largest distance in [m] of a smooth path from the lines between its points, by task
    choice: str | None  # how the start was chosen, in words; None when all of it was given
    path_lengths: Mapping[str, float]  # length of each task's path on the surface in [m]
    checks: tuple[Check, ...]  # the verified statements
    moved: tuple[MovedStart, ...]  # how far starts were moved to their tasks
    left_out: tuple[LeftOut, ...]  # what was not judged in full, but for two links of one robot's file

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)


def check(cell: Cell, *, scene: Scene | None = None, progress: Progress = silent) -> CellCheck:
    """Project the paths onto the part, examine or find the start postures, and look for collisions and loads there.

    Raises:
        InputError: A path misses the part, or a given start is out of limits or off its task.
        NoSolutionError: No start posture was found.
    """
    refuse_far_runs(cell)
    if cell.program.is_home_to_home:
        return _check_program(cell, progress)
    return _check_together(scene or Scene.from_cell(cell), progress)


def _check_program(cell: Cell, progress: Progress) -> CellCheck:
    """The checks of each block of tasks of a program from home to home, at its begin."""
    scenes, blocks = StageScenes.of(cell), [stage for stage in program_stages(cell) if stage.cell.tasks]
    refuse_sunk_parts(scenes)
    refuse_hanging_parts(scenes)
    refuse_unnamed_supports(scenes)
    refuse_touching_configurations(scenes.held)
    made = {
        stage.phase.name: _check_together(scenes.of_stage(stage), progress) for stage in blocks if stage.move is None
    }
    checks = [replace(check, message=f"{name}: {check.message}") for name, one in made.items() for check in one.checks]
    words = [f"{name}: {one.choice}" for name, one in made.items() if one.choice is not None]
    first = first_blocks(cell)
    robots = []
    for robot in cell.robots:
        in_phase = next((one.cell for one in made.values() if first.get(robot.name) in one.path_lengths), None)
        robots.append(
            robot
            if in_phase is None or robot.start is not None
            else replace(robot, start=in_phase.robot(robot.name).start)
        )
    return CellCheck(
        cell=replace(cell, robots=tuple(robots)),
        searched=tuple(dict.fromkeys(name for one in made.values() for name in one.searched)),
        choice="; ".join(words) or None,
        path_lengths={name: length for one in made.values() for name, length in one.path_lengths.items()},
        bulges={name: bulge for one in made.values() for name, bulge in one.bulges.items()},
        checks=tuple(checks),
        moved=tuple(dict.fromkeys(moved for one in made.values() for moved in one.moved)),
        left_out=scenes.held.left_out,
    )


def _check_together(scene: Scene, progress: Progress) -> CellCheck:
    """The checks of tasks that are worked on together, or one after the other from the same start."""
    cell = scene.cell
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    cell, moved = with_placed_starts(cell, toolpaths, scene.chains)
    scene = replace(scene, cell=cell)
    paths = clock_paths(cell, toolpaths.values())
    choice = chosen_start(scene, paths, progress=progress)
    started, more = with_chosen_start(cell, choice.start, toolpaths)
    start = choice.start
    pair = _touching_at_start(scene, start)
    searched = tuple(robot.name for robot in cell.robots if robot.start is None)
    words = "no collision at the start" if pair is None else f"'{pair[0]}' touches '{pair[1]}' at the start"
    bodies, value = ("cell", 0.0) if pair is None else (f"{pair[0]} - {pair[1]}", 1.0)
    at_start = Check("start_collision", bodies, pair is None, words, value=value, limit=0.0, unit="pairs", at_s=0.0)
    loads = [*check_payload_at_rest(cell, scene.chains, start), *check_torques_at_rest(cell, start)]
    return CellCheck(
        cell=started,
        searched=searched,
        choice=choice.words,
        path_lengths={name: toolpath.length for name, toolpath in toolpaths.items()},
        bulges={name: toolpath.bulge for name, toolpath in toolpaths.items() if toolpath.bulge is not None},
        checks=(
            at_start,
            *_on_trial(choice),
            *check_mounting(scene, start[None]),
            *depths_on_paths(cell, toolpaths),
            *(load for load in loads if load.name == "payload" or not load.passed),
        ),
        moved=(*moved, *more),
        left_out=scene.left_out,
    )


def _on_trial(choice: StartChoice) -> Iterator[Check]:
    """Whether the motion from a start that was searched for is without fault on a coarse clock."""
    if choice.trial is None or choice.words is None:
        return
    is_sound = choice.trial.is_sound
    message = choice.words if is_sound else f"{choice.words}; cellplan solve decides, on the accurate clock"
    yield Check(
        "start_trial", "cell", is_sound, message, value=0.0 if is_sound else 1.0, limit=0.0, unit="faults", at_s=None
    )


def _touching_at_start(scene: Scene, start: Array) -> tuple[str, str] | None:
    """The first two bodies that touch at the start of a run; idle robots are at their homes where these are known."""
    for phase in plan_phases(scene.cell).program:
        of_run = scene_of_run(scene, phase.tasks)
        pair = of_run.touching(standing(scene.cell, phase, start), among=present_pairs(of_run, phase))
        if pair is not None:
            return pair
    return None


# Text


def check_lines(record: Record) -> list[str]:
    """All lines about a checked cell."""
    starts: list[Row] = [
        (f"start of {robot}", "searched" if robot in record["start_found"] else "given", _posture(start))
        for robot, start in record["start"].items()
    ]
    paths: list[Row] = [
        (f"task {name}", f"{length:.4g} mm", direction_text(record["direction"][name]))
        for name, length in record["path_length_mm"].items()
    ]
    bulges: list[Row] = [
        (f"task {name}", f"{bulge:.3g} mm", "largest bulge of its path from the sides between its points")
        for name, bulge in record["path_bulge_mm"].items()
        if bulge
    ]
    controllers: list[Row] = [
        (f"controller {name}", controller["kind"], ", ".join(controller["robots"]))
        for name, controller in record["controllers"].items()
    ]
    controllers += [(f"programs {form}", "nothing missing", "") for form in record.get("for", ())]
    return [
        f"{record['cell']}: {record['status']}",
        f"  {count_text(record['checks'])}",
        *failure_lines(record["checks"], "check --json"),
        *aligned([*starts, *paths, *bulges, *controllers]),
        *(f"  {line}" for line in moved_start_lines(record["moved_starts"])),
        *(f"  note: {remark}" for remark in record["remarks"]),
        *(f"  {check['message']}" for check in record["checks"] if check["passed"] and not reaches_nowhere(check)),
        *left_out_lines(record, MORE),
    ]


def _posture(start: Record) -> str:
    return ", ".join(
        f"{joint} {round(position, 9) + 0.0:.4g}" for joint, position in start.items()
    )  # -1e-12 is rounding
