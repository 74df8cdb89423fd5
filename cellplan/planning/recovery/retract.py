"""Retract: every robot that is nearer to something than is demanded goes straight off it, together or one by one.

A robot leaves along the axis of its tool, which is also how tools come to their paths; where that is not free, in a few
other directions. A motion counts as free when every pair that begins too near only comes apart (``certify.growth``).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.growth import Growth, rows_too_near, sampled_growth, signed_distances
from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.scene import Scene

MARGINS: Final = (0.05, 0.02, 0.1, 0.005, 0.2)  # [m] beyond the largest demand that a tool goes, in the order of trial
SAMPLES: Final = 31  # configurations of robots that retract together
STEP: Final = 0.002  # [m] between two configurations of a line
CLOSED: Final = 1e-7  # [m, rad] within which the tool is on the line
ITERATIONS: Final = 12
LONGEST_MOVE: Final = 0.15  # [rad, m] of a joint from one configuration to the next: more is near a singularity
DAMPING: Final = 1e-5  # of the normal equations, in shares of their largest entry
COUNTS: Final = (6, 5, 3)  # components that are kept: all, all but the turn about the tool's axis, the place only
TILT: Final = 0.4  # [-] tangent of the angle between the tool's axis and the directions tried beside it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RetractLine:
    """A straight retract of one robot."""

    robot: str  # its name
    lengths: Array  # how far the tool has come at each configuration in [m], shape (M,), from 0
    q: Array  # the joints of the robot, shape (M, n)
    words: str  # the direction

    def up_to(self, length: float) -> "RetractLine":
        """Its beginning; all of it where it is shorter."""
        count = int(np.searchsorted(self.lengths, length + 0.5 * STEP))
        return RetractLine(robot=self.robot, lengths=self.lengths[:count], q=self.q[:count], words=self.words)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RetractLeg:
    """One straight retract of one robot, or of several together."""

    q: Array  # stacked joint positions in [rad] or [m] along it, shape (M, nq)
    lines: tuple[RetractLine, ...]  # the line of each robot

    @property
    def length(self) -> float:
        """How far the tool comes that goes farthest, in [m]."""
        return max(float(line.lengths[-1]) for line in self.lines)

    @property
    def words(self) -> str:
        """What is done."""
        return ", ".join(f"{line.robot} {MM * line.lengths[-1]:g} mm {line.words}" for line in self.lines)


def find_retract(scene: Scene, q: Array, *, may_move: Collection[str]) -> tuple[RetractLeg, ...]:
    """Retracts after which every pair keeps its demand; none where all do already.

    Args:
        scene: See ``certify.growth.scene_at_stop``.
        q: Stacked joint positions in [rad] or [m] at which the cell stands, shape (nq,).

    Raises:
        TransferNotFoundError: A pair that is too near belongs to robots that stand, or no free retract was found.
    """
    near = rows_too_near(scene, q)
    if not near:
        return ()
    search = _RetractSearch(scene, q, near, may_move)
    legs = search.one_by_one()
    return (search.together(legs) or legs) if len(legs) > 1 else legs


class _RetractSearch:
    """The retract from one configuration."""

    def __init__(self, scene: Scene, q: Array, near: Sequence[int], may_move: Collection[str]) -> None:
        self._scene, self._q, self._near = scene, q, near
        self._lines = Lines(scene.cell, q)
        self._pairs: dict[str, list[int]] = {}
        self._demand = max(scene.pairs[row].demand for row in near)
        self._at_work: dict[str, tuple[str, ...]] = {}
        for row in near:
            self._add(row, may_move)

    def _add(self, row: int, may_move: Collection[str]) -> None:
        """Find who is to come off a pair: operators before the holder of the part."""
        scene, pair = self._scene, self._scene.pairs[row]
        bodies = [scene.bodies[pair.first], scene.bodies[pair.second]]
        robots = {body.robot for body in bodies if body.robot is not None}
        held = next((str(body.robot) for body in bodies if body.kind is Kind.PART and body.robot), None)
        others = tuple(sorted(robots - {held}))
        able = [name for name in others if name in may_move] or [name for name in sorted(robots) if name in may_move]
        is_within_robot = bodies[0].robot == bodies[1].robot
        if not able or not robots or (len(robots) == 1 and held is None and is_within_robot):
            first, second = scene.names(pair)
            distance = float(signed_distances(scene, pair, self._q[None])[0])
            raise TransferNotFoundError(
                f"'{first}' is {_shown(distance)} '{second}' and no robot that may move takes them apart: "
                f"{MM * pair.demand:g} mm are demanded"
            )
        for name in able:
            self._pairs.setdefault(name, []).append(row)
            if name == held:
                self._at_work[name] = tuple({*self._at_work.get(name, ()), *others})

    def one_by_one(self) -> tuple[RetractLeg, ...]:
        """One robot after the other, each as soon as a line of it is free among those that have retracted."""
        legs: list[RetractLeg] = []
        state, waiting, faults = self._q.copy(), list(self._pairs), dict[str, str]()
        while waiting:
            for name in waiting:
                leg = self._leg(name, state, waiting, faults)
                if leg is not None:
                    break
            else:
                raise TransferNotFoundError("; ".join(faults[name] for name in waiting))
            legs.append(leg)
            state = leg.q[-1]
            waiting.remove(name)
            still = set(rows_too_near(self._scene, state))
            waiting = [robot for robot in waiting if still & set(self._pairs[robot])]
        return tuple(legs)

    def together(self, legs: Sequence[RetractLeg]) -> tuple[RetractLeg] | None:
        """All robots at once; None where that is not free."""
        lines = tuple(line for leg in legs for line in leg.lines)
        q = np.tile(self._q, (SAMPLES, 1))
        for line in lines:
            at = np.linspace(0.0, line.lengths[-1], SAMPLES)
            columns = self._scene.cell.columns(line.robot)
            q[:, columns] = np.column_stack([np.interp(at, line.lengths, column) for column in line.q.T])
        growth = sampled_growth(self._scene, q, near=self._near, moved=range(len(self._scene.pairs)))
        return (RetractLeg(q=q, lines=lines),) if growth.is_clear else None

    def _leg(self, robot: str, state: Array, waiting: Sequence[str], faults: dict[str, str]) -> RetractLeg | None:
        """The first line of a robot that is free while all others stand; None where none is."""
        near = rows_too_near(self._scene, state)
        others = {row for name in waiting if name != robot for row in self._pairs[name]}
        robot_pairs = set(self._pairs[robot]) - others or set(self._pairs[robot])
        moved = rows_moved_by(self._scene, robot)
        first_fault, tried = "", 0
        for line in self._candidates(robot):
            tried += 1
            q = np.tile(state, (len(line.q), 1))
            q[:, self._scene.cell.columns(robot)] = line.q
            growth = sampled_growth(self._scene, q, near=near, moved=moved)
            left = {row for row, pair in zip(near, growth.apart, strict=False) if pair.row is None}
            if growth.is_proved and not left & robot_pairs:
                return RetractLeg(q=q, lines=(line,))
            if not first_fault:
                fault = _fault(growth, self._scene, q, near)
                first_fault = f"{robot}: the retract of {MM * line.lengths[-1]:g} mm {line.words} {fault}"
        faults[robot] = (
            f"{first_fault}; tried {tried} directions and lengths"
            if tried
            else (f"{robot}: its tool comes no millimetre off in any direction within the joint limits")
        )
        return None

    def _candidates(self, robot: str) -> Iterator[RetractLine]:
        """Lines of a robot, the best first."""
        longest = self._demand + max(MARGINS)
        for direction, words in self._lines.directions(robot, self._at_work.get(robot, ())):
            line = self._lines.line(robot, direction, words, longest=longest)
            lengths = dict.fromkeys(line.up_to(self._demand + margin).lengths[-1] for margin in MARGINS) if line else {}
            for length in lengths:
                if line is not None and length > 0.0:
                    yield line.up_to(float(length))


def _fault(growth: Growth, scene: Scene, q: Array, near: Sequence[int]) -> str:
    """Why a retract is not free."""
    if growth.faults:
        (first, second), what = growth.faults[0]
        return f"is not free: '{first}' to '{second}' {what}"
    if not growth.bound.is_met:
        others = [row for row in range(len(scene.pairs)) if row not in set(near)]
        bound = certify(scene_of_rows(scene, others), q, with_curves=False)
        pairs = [pair for pair in bound.pairs if not pair.is_met]
        if pairs:
            worst = min(pairs, key=lambda pair: pair.proved - pair.demand)
            first, second = bound.names(worst)
            return f"brings '{first}' {_shown(worst.proved)} '{second}', {MM * worst.demand:.3g} mm are demanded"
    left = [pair for pair in growth.apart if pair.row is None]
    if left:
        first, second = left[0].names
        return f"leaves '{first}' {_shown(left[0].end)} '{second}', {MM * left[0].demand:.3g} mm are demanded"
    return "is not free"


def _shown(distance: float) -> str:
    """A signed distance in words."""
    return f"{MM * distance:.3g} mm from" if distance > 0.0 else f"{-MM * distance:.3g} mm deep in"


class Lines:
    """Straight lines of the tools of a cell from one stacked configuration."""

    def __init__(self, cell: Cell, q: Array) -> None:
        """Place the cell at stacked joint positions in [rad] or [m], shape (nq,)."""
        self._cell, self._q, self._model = cell, q, CombinedModel(cell)
        self._X_WT = self._model.state(q).X_WT

    def directions(self, robot: str, others: Iterator[str] | tuple[str, ...] = ()) -> list[tuple[Array, str]]:
        """Unit directions in the world that the tool of a robot may leave in, the best first, each in words.

        Args:
            others: Robots that work on what this robot holds, and stand still: it may leave along their tools.
        """
        R = self._X_WT[self._cell.index(robot)][:3, :3]
        up = np.array([0.0, 0.0, 1.0])
        x, y, z = R.T
        candidates = [(-z, "along its tool axis")]
        is_holder = robot in self._cell.positioners
        for other in others:
            candidates.insert(0, (self._X_WT[self._cell.index(other)][:3, 2], f"along the tool axis of '{other}'"))
        if is_holder:
            candidates.insert(0, (up, "upwards"))
        for side in (x, -x, y, -y):
            leaning = -z + TILT * side
            candidates.append((leaning / np.linalg.norm(leaning), "beside its tool axis"))
        return candidates if is_holder else [*candidates, (up, "upwards")]

    def line(self, robot: str, direction: Array, words: str, *, longest: float) -> RetractLine | None:
        """The line of a robot as far as it comes within its joint limits; None where it comes nowhere.

        Args:
            direction: Unit vector in the world, shape (3,).
            longest: Length in [m] at which it ends at the latest.
        """
        for count in COUNTS:
            q = self._followed(robot, direction, longest, count)
            if len(q) > 1:
                return RetractLine(robot=robot, lengths=np.arange(len(q), dtype=np.float64) * STEP, q=q, words=words)
        return None

    def _followed(self, robot: str, direction: Array, longest: float, count: int) -> Array:
        """Configurations of a robot along a line, shape (M, n); its own only where the next one is not reached."""
        index, columns = self._cell.index(robot), self._cell.columns(robot)
        model, X = self._cell.robot(robot).model, self._X_WT[index]
        configurations = [self._q[columns]]
        for number in range(1, round(longest / STEP) + 1):
            goal = X[:3, 3] + number * STEP * direction
            guess = configurations[-1] if number == 1 else 2.0 * configurations[-1] - configurations[-2]
            q = self._reached(index, columns, guess, goal, X[:3, :3], count)
            if q is None or np.abs(q - configurations[-1]).max() > LONGEST_MOVE:
                break
            if np.any((q < model.lower) | (q > model.upper)):
                break
            configurations.append(q)
        return np.array(configurations)

    def _reached(self, index: int, columns: slice, guess: Array, goal: Array, R: Array, count: int) -> Array | None:
        """Joints of a robot that put its tool at a point with an orientation; None where Newton's steps do not."""
        q = self._q.copy()
        q[columns] = guess
        weights = 1.0 / self._cell.robots[index].weights
        for _ in range(ITERATIONS):
            state = self._model.state(q)
            X = state.X_WT[index]
            turn = R.T @ X[:3, :3]
            turned = 0.5 * np.array([turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]])
            error = np.concatenate([R.T @ (goal - X[:3, 3]), turned])[:count]
            if np.abs(error).max() < CLOSED:
                return q[columns]
            screws = state.screws_W[:, columns] * self._model.carries_flange[index, columns]
            linear = screws[:3] + np.cross(screws[3:].T, X[:3, 3]).T
            J = np.concatenate([R.T @ linear, R.T @ screws[3:]])[:count]
            normal = (J * weights) @ J.T
            normal += DAMPING * DAMPING * np.trace(normal) * np.eye(count)
            q[columns] += weights * (J.T @ np.linalg.solve(normal, error))
        return None
