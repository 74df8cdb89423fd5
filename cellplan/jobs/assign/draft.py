"""Drafts: cells whose tasks are open to several robots, and what an assignment refuses of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.load import CellFile, load_open_cell
from cellplan.files.cell.open_tasks import open_tasks
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Mode, Robot, Timing
from cellplan.model.robot.robot import configuration_in_si, start_keys
from cellplan.model.settings.assign import POSTURE_LIMIT, AssignEntry
from cellplan.runs.overrides import read_settings
from cellplan.runs.plan.program_faults import refuse_crowded_homes, refuse_touching_configurations
from cellplan.runs.run_lengths import refuse_open_runs
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.goals import Stations, task_goals
from cellplan.search.assign.problem.reach import places_in_reach
from cellplan.search.assign.problem.table import BranchFollower

POSE_KEYS = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")  # of the part in the world
RESTS = (Mode.SEMI_COORDINATED, Mode.PART_AT_REST)  # modes in which the part rests while tools are at work


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssignmentDraft:
    """A cell with open tasks.

    Attributes:
        cell: Each open task with the first of its robots.
        robots: Robots that may do each open task.
        file: The file that it was read from.
    """

    cell: Cell
    robots: Mapping[str, Sequence[str]]
    file: Path

    @classmethod
    def load(
        cls, file: Path | str, *, allow_dirs: Sequence[Path] = (), settings: Sequence[str] = ()
    ) -> "AssignmentDraft":
        """Read a cell file.

        Args:
            file: The file.
            allow_dirs: Further folders that the files it names may lie in.
            settings: Values in place of those of the file, as ``KEY=VALUE``.

        Raises:
            InputError: The file cannot be read, or an assignment is not made for such cells; one located line each.
            HomeNotFoundError: Robots are too close to each other at their homes.
        """
        cell, robots = load_open_cell(file, allow_dirs=allow_dirs, values=read_settings(settings))
        refuse_unless_assignable(cell)
        for task in cell.tasks:
            if task.name in robots and task.start_posture is not None:
                raise InputError(
                    f"{task.where('start_deg')}: unexpected key of an open task, whose robot is not known yet"
                )
            if task.name in robots and any(isinstance(it, np.ndarray) for it in (*task.via_before, *task.via_after)):
                raise InputError(f"{task.where('via')}: expected home at an open task, whose robot is not known yet")
        draft = cls(cell=cell, robots=robots, file=Path(file))
        draft.stations()  # these and the homes are refused before anything is searched
        scene = Scene.from_cell(cell)
        refuse_crowded_homes(scene, draft.home)
        refuse_touching_configurations(scene)
        return draft

    def without(self, tasks: Sequence[str]) -> "AssignmentDraft | None":
        """The draft without some tasks and all that come after them, where a robot is missing; None where nothing is.

        None too where no task is left, or where the file names the tasks elsewhere.
        """
        left_out = set(tasks)
        while more := {it.name for it in self.cell.tasks if left_out.intersection(it.after)} - left_out:
            left_out |= more
        if not self.absent or len(left_out) == len(self.cell.tasks):
            return None
        try:
            cell = self.cell.with_values({f"tasks.{name}": None for name in left_out})
        except InputError:
            return None
        return replace(self, cell=cell, robots={name: it for name, it in self.robots.items() if name not in left_out})

    @property
    def absent(self) -> tuple[str, ...]:
        """Robots that are not available."""
        robots: Any = self.cell.origin.document["robots"]
        return tuple(name for name, robot in robots.items() if not robot.get("available", True))

    def with_robot(self, name: str) -> "AssignmentDraft":
        """The draft if a robot were available: its tasks are its alone, and open ones are open to it too."""
        source = self.cell.origin.source
        root: Any = source.document_with(source.changes).root if isinstance(source, CellFile) else {}
        robot = {**root["robots"][name], "available": True}
        opened = open_tasks({**root, "robots": {**root["robots"], name: robot}})
        robots = {task: opened.get(task, (name,)) for task in self.robots}
        return replace(self, cell=self.cell.with_values({f"robots.{name}.available": True}), robots=robots)

    @property
    def settings(self) -> AssignEntry:
        """What may be chosen."""
        return self.cell.assign or AssignEntry()

    @property
    def operators(self) -> tuple[str, ...]:
        """Robots that are available and do not hold the part."""
        others = {*self.cell.positioners, *self.absent}
        return tuple(robot.name for robot in self.cell.robots if robot.name not in others)

    @property
    def may_move_part(self) -> bool:
        """Whether a robot holds the part that could turn it while tasks are done."""
        return bool(self.cell.positioners) and self.cell.motion.mode is Mode.SEMI_COORDINATED

    @property
    def home(self) -> Array:
        """Stacked homes of all robots in [rad] or [m], shape (nq,); the start of a holder without a home."""
        homes = [robot.home if robot.home is not None else robot.start for robot in self.cell.robots]
        return np.concatenate([home for home in homes if home is not None])

    def stations(self) -> Stations:
        """The poses of the part that are compared.

        Raises:
            InputError: A station has other joints than the holder, or there are too many.
        """
        if not self.cell.positioners:
            if self.settings.stations is not None:
                where = self.cell.origin.at("assign.stations")
                raise InputError(f"{where}: unexpected key, no robot holds the part: remove it")
            return Stations.of(self.cell, np.zeros((1, 0)))
        holder, written = self.cell.robot(self.cell.positioners[0]), self.settings.stations
        where, is_free = self.cell.origin.at("assign.stations"), "station" in self.settings.free
        if written is None or not is_free:
            compared = self.holder_start[None]
        elif isinstance(written, Mapping) and set(written) & set(POSE_KEYS) - set(start_keys(holder.model)):
            compared = _at_poses(self, holder, written, where)
        elif isinstance(written, Mapping):
            compared = _grid(holder, written, where)
        else:
            compared = _listed(holder, written, where)
        given = [task.holder_posture for task in self.cell.tasks if task.holder_posture is not None]
        return Stations.of(self.cell, np.unique([*compared, *given], axis=0))

    @property
    def holder_start(self) -> Array:
        """Start of the holder in [rad] or [m], shape (n,), or its home."""
        return _start(self.cell.robot(self.cell.positioners[0]))

    def spins(self) -> Array:
        """Turns of the tools about their axes that are compared, beside those of the tasks, in [rad], shape (S,)."""
        step = self.settings.spin_step_deg if "spin" in self.settings.free else 360.0
        return np.radians(np.arange(0.0, 360.0, step))


def refuse_unless_assignable(cell: Cell) -> None:
    """Refuse cells of which no assignment is made.

    Raises:
        InputError: With what is wrong, where, and the cure.
    """
    at, program = cell.origin.at, cell.program
    if not program.is_home_to_home:
        raise InputError(
            f"{at('program')}: missing, expected program: {{}}, as an assignment is made from home to home"
        )
    refuse_open_runs(cell, "an assignment")
    if cell.positioners and cell.motion.mode not in RESTS:
        raise InputError(
            f"{at('motion.mode')}: expected semi_coordinated or part_at_rest, got {cell.motion.mode}: in what an "
            "assignment plans the part rests while tools are at work"
        )
    if program.all_marks or program.attach is not None or program.detach is not None:
        raise InputError(
            f"{at('program')}: expected no marks, attach or detach, as an assignment orders all tasks itself"
        )
    for task in cell.tasks:
        if task.holder_moves:
            raise InputError(
                f"{task.where('holder_moves')}: unexpected key, as an assignment chooses the blocks in which the part "
                "moves: write assign.groups: true instead"
            )
    if cell.assign is not None and cell.assign.groups:
        _refuse_moving_blocks(cell)
    if len(cell.positioners) > 1:
        raise InputError(f"{at('part.held_by')}: expected one robot that holds the part, got {len(cell.positioners)}")
    for robot in cell.robots:
        if robot.home is None and (robot.name not in cell.positioners or robot.start is None):
            raise InputError(f"{at(f'robots.{robot.name}')}: missing, expected home_deg, from which a program begins")
        if f"robots.{robot.name}.order" in cell.origin.lines:
            raise InputError(f"{at(f'robots.{robot.name}.order')}: unexpected key, write after in the tasks instead")


def _refuse_moving_blocks(cell: Cell) -> None:
    """Refuse cells in which the part cannot move while tasks are done."""
    where = cell.origin.at("assign.groups")
    if not cell.positioners:
        raise InputError(f"{where}: unexpected key, no robot holds the part: remove it")
    if cell.motion.mode is not Mode.SEMI_COORDINATED:
        raise InputError(f"{where}: expected motion.mode: semi_coordinated, got {cell.motion.mode}")
    if cell.motion.timing is not Timing.AS_WRITTEN:
        raise InputError(f"{where}: expected motion.timing: as_written, got {cell.motion.timing}")


def _start(holder: Robot) -> Array:
    """The start of a holder, or its home."""
    start = holder.start if holder.start is not None else holder.home
    return np.zeros(len(holder.model.joints)) if start is None else start


def _listed(holder: Robot, configurations: Sequence[Sequence[float]], where: str) -> Array:
    """Configurations in a list, in [rad] or [m], shape (K, n)."""
    count = len(holder.model.joints)
    for index, configuration in enumerate(configurations):
        if len(configuration) != count:
            values = f"{count} values, one for each joint of '{holder.name}'"
            raise InputError(f"{where}[{index}]: expected {values}, got {len(configuration)}")
    return np.array([configuration_in_si(holder.model, configuration) for configuration in configurations])


def _grid(holder: Robot, ranges: Mapping[str, Sequence[float]], where: str) -> Array:
    """All configurations of a grid, in [rad] or [m], shape (K, n)."""
    keys, start = start_keys(holder.model), _start(holder)
    written = _spanned(ranges, keys, f"a joint of '{holder.name}'", where)
    values = []
    for column, key in enumerate(keys):
        given = [[it] * len(keys) for it in written.get(key, ())]
        values.append([float(configuration_in_si(holder.model, it)[column]) for it in given] or [float(start[column])])
    configurations = np.array(list(product(*values)))
    inside = np.all((configurations >= holder.model.lower) & (configurations <= holder.model.upper), axis=1)
    if not inside.any():
        raise InputError(f"{where}: expected a configuration within the joint limits of '{holder.name}', got none")
    return configurations[inside]


def _at_poses(draft: AssignmentDraft, holder: Robot, ranges: Mapping[str, Sequence[float]], where: str) -> Array:
    """Configurations that bring the part to the poses of a grid, the nearest to the start, in [rad] or [m], (K, n).

    Where no coordinate is given, each orientation has the place in the common reach where most can be done.
    """
    cell, start = draft.cell, _start(holder)
    written = _spanned(ranges, POSE_KEYS, "a coordinate or an angle of the part", where)
    X_WP = Stations.of(cell, start[None]).X_WP[0]
    given = {key: [1e3 * float(it)] for key, it in zip(POSE_KEYS, X_WP[:3, 3], strict=False)}
    values = product(*(written.get(key, given.get(key, [0.0])) for key in POSE_KEYS))
    X_WP_grid = np.array([pose(np.array(it[:3]) / 1e3, np.radians(it[3:])) for it in values])
    tries = X_WP_grid[:, None]  # shape (K, places, 4, 4), the best place first
    if not set(written) & set(given):
        goals, most = task_goals(cell, draft.robots), max(1, POSTURE_LIMIT // len(X_WP_grid))
        tries = np.repeat(tries, most, axis=1)
        tries[:, :, :3, 3] = places_in_reach(cell, goals, X_WP_grid, most=most)
    reached = BranchFollower.of(holder).follow((tries.reshape(-1, 4, 4) @ cell.part.held_by[0].X_PT)[:, None])
    far = np.abs(reached.q[:, 0] - start).max(axis=1, initial=0.0)
    nearest: dict[int, int] = {}
    for index in np.lexsort((far, reached.rows)).tolist():
        nearest.setdefault(int(reached.rows[index]) // tries.shape[1], index)
    if not nearest:
        raise InputError(
            f"{where}: expected a pose of the part to which '{holder.name}' can bring it within its joint limits, got "
            f"none of {len(X_WP_grid)}: give x_mm, y_mm and z_mm nearer to it, or other angles"
        )
    return reached.q[[nearest[row] for row in sorted(nearest)], 0]


def _spanned(
    ranges: Mapping[str, Sequence[float]], keys: Sequence[str], what: str, where: str
) -> dict[str, list[float]]:
    """The values that each key spans, in the units of the file.

    Args:
        keys: Keys that may be given.
        what: What they stand for, in words.
    """
    spanned: dict[str, list[float]] = {}
    for key, (first, last, step) in ranges.items():
        if key not in keys:
            raise InputError(f"{where}.{key}: expected {what}: {', '.join(keys)}")
        if not step > 0.0 or last < first:
            raise InputError(
                f"{where}.{key}: expected [first, last, step] with a step above 0, got [{first:g}, {last:g}, {step:g}]"
            )
    counts = {key: np.floor((last - first) / step + 1e-9) + 1 for key, (first, last, step) in ranges.items()}
    if (count := np.prod(list(counts.values()))) > POSTURE_LIMIT:
        raise InputError(
            f"{where}: expected at most {POSTURE_LIMIT} configurations, got {count:.0f}: take longer steps"
        )
    for key, (first, _, step) in ranges.items():
        spanned[key] = (first + step * np.arange(int(counts[key]))).tolist()
    return spanned
