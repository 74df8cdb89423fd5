"""What all starts of one cell share: its variables, its job at nodes, its bodies and the paths of its tools."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cellplan.errors import StartNotFoundError
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Frame
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.scene.bodies import Kind, is_ground
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.distances.layout_pairs import among, demands_of, layout_pairs
from cellplan.search.kernel.job import Job, Layouts, enough_nodes
from cellplan.search.starts.freedom import FIXED, Freedom, StartVariables
from cellplan.search.starts.reaching import BaseBounds, FreeArm, Goal

NODES: Final = 65  # [-] of a motion: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg
NODES_AT_REST: Final = 24  # [-] of a path with the part at rest
NODES_AT_REST_FINE: Final = 60  # [-] where no base follows at these: wrists turn far between them
AT_ONCE: Final = 192  # configurations in one call: arrays of all pairs stay small


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shortfalls:
    """By how much S configurations fall short of what is demanded."""

    worst: Array  # largest shortfall of any pair in [m]; 0 or less where all keep their distance, shape (S,)
    pair: tuple[tuple[str, str] | None, ...]  # the two bodies that fall short most; None where none do


class Contacts:
    """The pairs of a scene that concern some robots, wherever these stand.

    Columns below bases keep their height and go with them, tools keep their bodies, and pairs that the design of a
    robot keeps near are left out. So the answer is a first one: ``CellDistances`` knows better.
    """

    def __init__(self, scene: Scene, robots: Iterable[str], against: Iterable[str] = ()) -> None:
        """Keep the pairs of which a body goes with one of some robots, the other with any of these or with none."""
        members = set(robots)
        known, anyone = {*members, *against, None}, {body.name: body.robot for body in scene.bodies}
        self._pairs, watched = layout_pairs(scene)
        is_design = [pair.rule is Rule.CONTACT for pair in scene.pairs] + [
            scene.bodies[pair.first].kind is Kind.PEDESTAL and is_ground(scene.bodies[pair.second])
            for pair in scene.mounted  # the height of a column follows from the ground that it stands on
        ]
        owners = [{anyone[name] for name in pair.names} for pair in self._pairs]
        is_watched = [
            not design and not (pair.within_robot and pair.is_fixed) and known >= owner and bool(members & owner)
            for pair, design, owner in zip(self._pairs, is_design, owners, strict=True)
        ]
        watched = among(watched, np.array(is_watched, dtype=bool))
        watched = replace(
            watched, once=np.zeros(len(watched.rows), dtype=bool)
        )  # every configuration is another layout
        self._table, self._engine = replace(scene.near_table, pairs=watched), scene.engine
        self._demands = demands_of(self._pairs)

    def shortfalls(self, X_WB: Array, q: Array) -> Shortfalls:
        """By how much configurations fall short.

        Args:
            X_WB: Bases of all robots, shape (S, robots, 4, 4).
            q: Stacked joint positions in [rad] or [m], shape (S, nq).
        """
        worst, pair = np.full(len(q), -np.inf), list[tuple[str, str] | None]()
        for first in range(0, len(q), AT_ONCE):
            group = slice(first, first + AT_ONCE)
            worst[group], names = self._of_group(X_WB[group], q[group])
            pair += names
        return Shortfalls(worst=worst, pair=tuple(pair))

    def _of_group(self, X_WB: Array, q: Array) -> tuple[Array, list[tuple[str, str] | None]]:
        """The same of a few configurations."""
        worst, names = np.full(len(q), -np.inf), list[tuple[str, str] | None]([None] * len(q))
        rows = self._table.pairs.rows
        if not len(rows):
            return worst, names
        D = self._table.forest.displacements(q, np.swapaxes(X_WB, 0, 1))
        nearby = self._table.find(self._engine, D, float(self._demands[rows].max()))
        short = self._demands[nearby.rows] - nearby.distances
        for place in np.argsort(short, kind="stable").tolist():
            sample = int(nearby.samples[place])
            worst[sample] = short[place]
            names[sample] = self._pairs[nearby.rows[place]].names if short[place] > 0.0 else None
        return worst, names


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StartProblem:
    """A cell whose layout is searched."""

    cell: Cell
    variables: StartVariables  # what is varied
    freedom: Freedom  # which of it places which robot
    paths: Mapping[str, ClockedPath]  # path of every task on the common clock, by its name
    start: Array  # start postures of the given layout, in mid-range where none is given, in [rad] or [m], shape (nq,)
    margin: Array  # demanded distance of each joint from its limits in [rad] or [m], shape (nq,)
    acceleration: Array  # largest ones as the checks judge them, in [rad/s^2] or [m/s^2], shape (nq,)
    job: Job  # the tasks at the nodes of a motion
    at_rest: Job  # the tasks at fewer nodes, for paths with the part at rest
    at_rest_fine: Job  # the same at more of them
    scene: Scene  # the bodies
    arms: tuple[FreeArm, ...]  # kinematics of each robot, base and tool left open
    distances: CellDistances  # what each layout is judged by in the end
    all_contacts: Contacts  # all pairs
    contacts: tuple[Contacts, ...]
    is_part_placed: bool = False  # whether the part stands where a setting has it, not where the file has it

    @classmethod
    def of(cls, cell: Cell, variables: StartVariables, *, margin: Array | float = 0.0) -> "StartProblem":
        """Prepare a cell.

        Args:
            cell: The cell; its first phase is what starts are judged by.
            margin: Demanded distance of the joints from their limits in [rad] or [m], shape (nq,) or one number.

        Raises:
            InputError: The paths or bodies of the cell are not usable.
        """
        scene = Scene.from_cell(cell)
        paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
        phase = plan_phases(cell).program[0]
        schedule, moving = schedule_paths(cell, [paths[name] for name in phase.tasks]), tuple(phase.moving)
        middles = [0.5 * np.add(*finite_limits(robot.model)) for robot in cell.robots]
        starts = [
            middle if robot.start is None else robot.start for robot, middle in zip(cell.robots, middles, strict=True)
        ]
        start = np.concatenate(starts)
        return cls(
            cell=cell,
            variables=variables,
            freedom=Freedom.of(cell, variables, start),
            paths=paths,
            start=start,
            margin=np.broadcast_to(np.asarray(margin, dtype=float), (cell.joint_count,)),
            acceleration=acceleration_limits(scene.cell),
            job=Job.of(cell, schedule, moving=moving, nodes=enough_nodes(schedule, NODES)),
            at_rest=Job.of(cell, schedule, moving=moving, nodes=NODES_AT_REST),
            at_rest_fine=Job.of(cell, schedule, moving=moving, nodes=NODES_AT_REST_FINE),
            scene=scene,
            arms=tuple(FreeArm(robot) for robot in cell.robots),
            distances=CellDistances.of(scene, variables),
            **_contacts(cell, scene),
        )

    def with_part(self, x: Array) -> "StartProblem":
        """The same with the part at rest where the variables have it, shape (n,); itself where that does not vary."""
        if not len(self.freedom.part):
            return self
        cell = replace(self.cell, part=self.variables.placed(x).part)
        return replace(self, cell=cell, is_part_placed=True, **_contacts(cell, Scene.from_cell(cell)))

    def placed_layouts(self, x: Array, start: Array) -> Layouts:
        """Bases and tools beside the part of the cell, x of shape (K, n) and start postures of shape (K, nq).

        The kernel leaves a part at rest in its place, and moves all bases the other way.
        """
        if self.is_part_placed:
            x = x.copy()
            x[:, self.freedom.part] = self.variables.given[self.freedom.part]
        return self.variables.layouts(x, start)

    def given_start(self) -> Array:
        """The start posture of the given layout, what is not given found as by a solve; else in mid-range, (nq,)."""
        if any(robot.start is None for robot in self.cell.robots):
            try:
                return choose_start(self.scene, self.paths).start
            except StartNotFoundError:  # nothing starts here: that is what a search is for
                pass
        return self.start

    @property
    def operators(self) -> tuple[int, ...]:
        """Indices of the robots with a task or grasp of their own, the first holder left out, in the order of these."""
        return tuple(index for index in self._working if index != self.cell.carrier)

    @property
    def _working(self) -> tuple[int, ...]:
        """Indices of the robots of all relations."""
        return tuple(self.cell.index(relation.robot) for relation in self.job.relations)

    def goal(self, robot: int, X_WP: Array) -> Goal | None:
        """The path of a robot with the part at rest, X_WP of shape (4, 4); None for robots without one."""
        if robot not in self._working:
            return None
        place = self._working.index(robot)
        relation = self.job.relations[place]
        X_WR = X_WP if relation.relative_to is Frame.PART else np.eye(4)
        return Goal(relation=relation, X_RT=np.moveaxis(self.at_rest.X[:, :, place], -1, 0), X_WR=X_WR)

    def part_pose(self, layouts: Layouts) -> Array:
        """The part at the start of the first of some layouts, shape (4, 4)."""
        if self.cell.carrier is None:
            return self.cell.part.X_CP
        columns = self.cell.columns(self.cell.positioners[0])
        X_BF = self.arms[self.cell.carrier].flanges(layouts.start[:1, columns])[0]
        X_WB, X_FT = (part[0, self.cell.carrier] for part in (layouts.X_WB, layouts.X_FT))
        return X_WB @ X_BF @ X_FT @ self.cell.part.X_CP

    def bounds(self, robot: int) -> BaseBounds:
        """How far the base of a robot may be moved."""
        columns = self.freedom.base[robot]
        lower, upper = (np.append(part, 0.0)[columns[:3]] for part in (self.variables.lower, self.variables.upper))
        return BaseBounds(is_free=columns != FIXED, lower=lower, upper=upper)

    def sampled_columns(self, robot: int) -> Indices:
        """Columns of what is drawn for an operator: all its own but the positions of its joints at the start."""
        columns = self.freedom.by_robot[robot]
        return columns[~np.isin(columns, self.freedom.columns)]

    def with_starts(self, x: Array, start: Array) -> Array:
        """Variables, shape (K, n), with those that are positions of joints at the start taken from these, (K, nq)."""
        changed, columns = x.copy(), self.freedom.columns
        changed[:, columns[columns != FIXED]] = start[:, columns != FIXED]
        return changed


def _contacts(cell: Cell, scene: Scene) -> dict[str, Any]:
    """All pairs, and those of each robot."""
    holder = cell.positioners[:1]
    return {
        "all_contacts": Contacts(scene, [robot.name for robot in cell.robots]),
        "contacts": tuple(Contacts(scene, [robot.name], holder) for robot in cell.robots),
    }
