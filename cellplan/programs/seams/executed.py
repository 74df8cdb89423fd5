r"""Seams as controllers execute them: rows of joints along each line and arc, and a tube round these.

A controller moves the tool straight, or on a circle, in a frame of the part and finds the joints as it goes, from those
at which the seam was entered. The rows are such joints at the places that the tool passes in the run. How far a tool
may be from the even motion between these is its *tube*: what the joints bend off the line between two rows, what the
rules of orientation differ, and what a rounded corner cuts. The tube of the joints follows from that of the tool, to
which a controller's own weave and sensors add where bodies are judged:

.. math:: |\delta q_i| \le |J^{-1}_{i,v}| \epsilon_p + |J^{-1}_{i,\omega}| \epsilon_r .

A body on the flange, at most r from the tip, moves by no more than :math:`\epsilon_p + r \epsilon_r`, which is less.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError, LineRefusedError, NotVerifiedError
from cellplan.geometry.transforms import Array, inverse, rotation_vector
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows, Seam
from cellplan.model.units import DEG, MM
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import part_pose
from cellplan.programs.elements.joints import Axes, in_step
from cellplan.programs.elements.process import ProcessForm, switches_in_motion
from cellplan.programs.rows.part_targets import POSE_TOL, solved_joints, tip_jacobians
from cellplan.programs.rows.rows import times_of
from cellplan.programs.seams.shapes import LARGEST_ARC, STANDS, Shape, arc, corner_cut, line
from cellplan.scene.kinematics.screw_chain import ScrewChain

LARGEST_STEP: Final = 0.05  # [rad] or [m] of a joint from row to row; more is a singular configuration that is passed
BENT: Final = 2.0  # [-] of what joints are off a line in the middle of a step: their largest deviation in it
RESERVE: Final = 1.2  # [-] of a Jacobian that changes within the tube
EDGE: Final = 2e-5  # [rad] from the edge of a configuration within which either of its sides is right
SPEED_TOL: Final = 1e-3  # [-] of a speed limit
BRANCH: Final = 0.01  # [rad] or [m] other joints of an arm that bring its tool to the same pose differ by more
BENDS: Final = 2e-4  # [rad] or [m] that joints of escape programs may be off their rows where they go back a seam
SLACK: Final = 3e-4  # [rad] or [m] the same with the rounding of numbers, for which bodies are judged


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamPath:
    """The path of a tool along one line or arc, and the joints on it."""

    shape: Shape
    shares: Array  # shares of its length at the rows, rising from 0 to 1, shape (M,)
    times: Array  # times of the rows in [s], shape (M,)
    q: Array  # joints there in [rad] or [m], shape (M, n)
    tube: Array  # in each step, shape (M - 1, 4 + n), see ``RobotRows.tube``


class SeamExecution:
    """The seams of one robot in a program that was read, as its controller executes them.

    Joints are those of the robot, and behind them those of all others that the controller moves in step with it.
    """

    def __init__(
        self, frame: ExportFrame, full: ProgramRows, read: ProgramRows, rows: RobotRows, *, dialect: Dialect
    ) -> None:
        """Take what a reader recovered, and the run, whose rows say which branch of the joints is meant."""
        self._frame, self._rows, self._dialect = frame, rows, dialect
        self._robot: Robot = frame.robot(rows.robot)
        self._chain = ScrewChain(self._robot)
        self._full, self._read = full, read
        others = (name for name in in_step(frame, rows.robot) if name != rows.robot)
        self._names = (rows.robot, *others)
        counts = [len(frame.robot(name).model.joints) for name in self._names]
        ends = np.cumsum([0, *counts]).tolist()
        self._columns = {n: slice(*span) for n, span in zip(self._names, pairwise(ends), strict=True)}
        self._even = [*Axes.of(self._robot).external, *range(ends[1], ends[-1])]  # joints that follow the path evenly
        self._q, run_q = (np.hstack([program.robots[name].q for name in self._names]) for program in (read, full))
        self._run_rows = times_of(full.robots[rows.robot]), run_q
        control = self._robot.control
        self._form = None if control is None else ProcessForm.of(frame.cell.controllers[control.id])

    def rows(self) -> dict[str, RobotRows]:
        """The rows of joints of each robot with their tube.

        ``NotVerifiedError`` where a seam cannot be executed as it is stated.
        """
        rows, count = self._rows, self._q.shape[1]
        times, inside = times_of(rows), {seam.first: seam for seam in rows.seams}
        pieces: list[tuple[Array, Array, Array]] = [(times[:1], self._q[:1], np.zeros((0, 4 + count)))]
        places = [0]
        row = 1
        while row < len(rows):
            seam = inside.get(row - 1)
            if seam is None:
                pieces.append((times[row : row + 1], self._q[row : row + 1], np.zeros((1, 4 + count))))
                places.append(places[-1] + 1)
                row += 1
                continue
            for at, path in self._seam(seam, pieces[-1][1][-1]):
                pieces.append((path.times[1:], path.q[1:], path.tube))
                while len(places) <= at:  # an intermediate point of an arc counts with its end
                    places.append(places[-1] + (len(path.times) - 1 if len(places) == at else 0))
            row = seam.last + 1
        return self._executed(pieces, np.array(places))

    def _executed(self, pieces: Sequence[tuple[Array, Array, Array]], places: Array) -> dict[str, RobotRows]:
        """Rows of all pieces; ``places`` are those of the rows that were read."""
        times, q, tube = (np.concatenate(columns) for columns in zip(*pieces, strict=True))
        rows = self._rows
        process, rounding = np.zeros(len(times), dtype=bool), np.zeros(len(times))
        if rows.process is not None:
            steps = np.searchsorted(places, np.arange(len(times)), side="right") - 1
            process = rows.process[steps]
        is_joint = np.ones(len(rows), dtype=bool) if rows.X_PT is None else np.isnan(rows.X_PT[:, 0, 0])
        if rows.rounding is not None:
            rounding[places[is_joint]] = rows.rounding[is_joint]
        marks = tuple(places[list(rows.marks)].tolist())
        robots = {}
        for name, columns in self._columns.items():
            is_arm = name == rows.robot
            tool = tube[:, :4] if is_arm else np.tile([0.0, 0.0, np.inf, np.inf], (len(tube), 1))
            robots[name] = RobotRows(
                robot=name,
                q=q[:, columns],
                times=times,
                process=process & is_arm,
                marks=marks,
                rounding=rounding,
                tube=np.hstack([tool, tube[:, 4:][:, columns]]),
            )
        return robots

    def _seam(self, seam: Seam, q_entry: Array) -> Iterator[tuple[int, SeamPath]]:
        """The lines and arcs of a seam with the rows at which they end, from the joints at which it is entered."""
        rows = self._rows
        if rows.X_PT is None or rows.feeds is None:
            raise InputError(f"robot '{rows.robot}': expected poses and speeds of the seam of '{seam.task}', got none")
        _require_motion(self._frame.cell, self._robot, seam.task)
        X, travelled, q = self._on_part(seam, q_entry[None])[0], 0.0, q_entry
        first = seam.first
        paths: list[tuple[int, SeamPath]] = []
        while first < seam.last:
            is_arc = rows.middles is not None and bool(rows.middles[first + 1])
            last = first + 1 + is_arc
            end = rows.X_PT[last]
            shape = arc(X, rows.X_PT[first + 1], end) if is_arc else line(X, end)
            if shape is None:
                raise LineRefusedError(
                    seam.task, f": row {last}: no arc of at most {DEG * LARGEST_ARC:.0f} deg leads through it"
                )
            path = self._path(seam, (first, last), shape, (q, travelled))
            paths.append((last, path))
            for row in range(first + 1, last + 1):
                share = 1.0 if row == last else float(shape.shares(rows.X_PT[row, None, :3, 3])[0])
                q_there = np.array([np.interp(share, path.shares, column) for column in path.q.T])
                self._require_configuration(seam, row, q_there[None], MM * (travelled + share * shape.length))
            X, travelled, q, first = end, travelled + shape.length, path.q[-1], last
        yield from self._with_corners(seam, paths)

    def _on_part(self, seam: Seam, q: Array) -> Array:
        """Poses of the tool in the frame of a seam, shape (N, 4, 4), for joints of shape (N, m)."""
        return inverse(self._part_poses(seam, q)) @ self._chain.tool_poses(q[:, self._columns[self._robot.name]])

    def _part_poses(self, seam: Seam, q: Array) -> Array:
        """The frame of a seam in the world, as its controller has it, shape (N, 4, 4), for joints of shape (N, m).

        It is one pose for all, shape (4, 4), where no robot that moves in step holds the part.
        """
        holder = self._frame.station(self._rows.robot, seam.task).holder
        if holder is None or holder in self._columns:
            held = {name: q[:, columns] for name, columns in self._columns.items()}
            return part_pose(self._frame, self._rows.robot, seam.task, held)
        rows = self._read.robots.get(holder, self._full.robots[holder])
        times = self._full.robots[holder].times if rows.times is None else rows.times
        at = 0.5 * float(np.sum(times_of(self._rows)[[seam.first, seam.last]]))
        q_holder = np.array([np.interp(at, times, column) for column in rows.q.T])  # type: ignore[arg-type]
        return part_pose(self._frame, self._rows.robot, seam.task, {holder: q_holder[None]})[0]

    def _path(self, seam: Seam, rows: tuple[int, int], shape: Shape, begin: tuple[Array, float]) -> SeamPath:
        """One line or arc between two rows, from some joints and a length of the seam."""
        (first, last), (q_entry, travelled) = rows, begin
        ends = times_of(self._rows)[[first, last]]
        run_times, run_q = self._run_rows
        inner = (run_times > ends[0] + STANDS) & (run_times < ends[1] - STANDS)
        times = np.concatenate([ends[:1], run_times[inner], ends[1:]])
        near = np.stack([np.interp(times, run_times, column) for column in run_q.T], axis=1)
        shares = shape.shares(self._on_part(seam, near)[:, :3, 3])
        shares[0], shares[-1] = 0.0, 1.0
        shares = np.maximum.accumulate(shares)
        if self._even and shape.length > STANDS:
            q_end = self._q[last, self._even]
            near[:, self._even] = q_entry[self._even] + shares[:, None] * (q_end - q_entry[self._even])
        X_WT = self._part_poses(seam, near) @ shape.poses(shares)
        q, columns = near.copy(), self._columns[self._robot.name]
        q[:, columns], misses = solved_joints(self._chain, X_WT, near[:, columns], arm=list(Axes.of(self._robot).arm))
        q[0] = q_entry
        places, feed = MM * (travelled + shares * shape.length), float(self._rows.feeds[last])  # type: ignore[index]
        _require_reached(self._robot, seam, q[:, columns], misses, places)
        for name, place in self._columns.items():
            robot, lengths = self._frame.robot(name), shares * shape.length
            _require_limits(robot, seam, q[:, place], places, feed=feed, lengths=lengths)
        is_on = self._rows.process is not None and bool(self._rows.process[first])
        if self._form is not None:
            _require_lead(self._form, seam, self._rows, rows, length=shape.length)
        tube = self._tube(seam, shape, shares, q, is_on=is_on)
        return SeamPath(shape=shape, shares=shares, times=times, q=q, tube=tube)

    def _require_configuration(self, seam: Seam, row: int, q: Array, place: float) -> None:
        """The configuration that was read with a pose is that of the joints; at an edge either side of it is right.

        Where joints were read they are those in which the arm comes to the end of a line or an arc.
        """
        read, function = self._rows.configuration, self._dialect.configuration
        arm = q[:, self._columns[self._robot.name]]
        off = np.abs(self._rows.q[row] - arm[0])  # NaN where poses were read
        if self._rows.middles is not None and not self._rows.middles[row] and np.any(off > BRANCH):
            raise NotVerifiedError(
                [
                    f"task '{seam.task}', {place:.1f} mm along its seam: expected the joints with which "
                    f"'{self._robot.name}' comes there, got others of joint "
                    f"{self._robot.model.joints[int(np.nanargmax(off))].name}"
                ]
            )
        if read is None or function is None:
            return
        near = [function(self._robot, arm + turn)[0] for turn in (-EDGE, 0.0, EDGE)]
        if not np.all(np.any(np.equal(near, read[row]), axis=0)):
            raise NotVerifiedError(
                [
                    f"task '{seam.task}', {place:.1f} mm along its seam: expected configuration {near[1].tolist()}, in "
                    f"which '{self._robot.name}' comes there, got {read[row].tolist()}"
                ]
            )

    def _tube(self, seam: Seam, shape: Shape, shares: Array, q: Array, *, is_on: bool) -> Array:
        """The tube of every step, without corners, shape (M - 1, 4 + n)."""
        middle = shape.poses(0.5 * (shares[:-1] + shares[1:]))
        X = self._on_part(seam, 0.5 * (q[:-1] + q[1:]))
        off = np.linalg.norm(X[:, :3, 3] - middle[:, :3, 3], axis=1)
        turned = np.linalg.norm(rotation_vector(X[:, :3, :3] @ np.swapaxes(middle[:, :3, :3], 1, 2)), axis=1)
        rules = shape.rule_margins(shares)
        tool = np.stack([BENT * off, BENT * turned + np.maximum(rules[:-1], rules[1:])], axis=1)
        judged = tool + np.array([self._form.tube if is_on and self._form else 0.0, 0.0])
        if self._dialect.sets_steps:
            J = tip_jacobians(self._chain, q[1:, self._columns[self._robot.name]]).reshape(len(tool), 2, 3, -1)
            moved = RESERVE * SLACK * np.linalg.norm(J, axis=2).sum(axis=2)
            return np.concatenate([tool, judged + moved, self._joints_off(judged, q) + SLACK], axis=1)
        return np.concatenate([tool, judged, self._joints_off(judged, q)], axis=1)

    def _joints_off(self, tool: Array, q: Array) -> Array:
        """How far joints may be off in each step for what a tool is, shape (M - 1, 2), shape (M - 1, n)."""
        arm, off = list(Axes.of(self._robot).arm), np.zeros((len(tool), q.shape[1]))
        J_inverse = np.abs(
            np.linalg.pinv(tip_jacobians(self._chain, q[1:, self._columns[self._robot.name]])[:, :, arm])
        )
        reach = np.stack([np.linalg.norm(J_inverse[:, :, part], axis=2) for part in (slice(3), slice(3, 6))], axis=2)
        off[:, arm] = RESERVE * np.einsum("mik,mk->mi", reach, tool)
        return off

    def _with_corners(self, seam: Seam, paths: Sequence[tuple[int, SeamPath]]) -> Iterator[tuple[int, SeamPath]]:
        """The pieces of a seam with what rounded corners between them cut, added to their tubes."""
        rounding = self._rows.rounding
        widened = [path.tube.copy() for _, path in paths]
        for place, (row, path) in enumerate(paths[:-1]):
            share = 0.0 if rounding is None else float(rounding[row])
            if share <= 0.0:
                continue
            other = paths[place + 1][1]
            radius = share * min(path.shape.length, other.shape.length)
            corner = corner_cut(path.shape, other.shape, radius)
            is_free = self._frame.cell.task(seam.task).is_spin_free
            on_tool = np.array([corner.cut, corner.swing if is_free else corner.turn])
            uneven, moved = self._uneven(seam, path, other, radius)
            on_joints = np.array([corner.cut, corner.turn]) + moved
            for piece, near in (
                (place, (1.0 - path.shares) * path.shape.length <= radius),
                (place + 1, other.shares * other.shape.length <= radius),
            ):
                steps = near[:-1] | near[1:]
                q = paths[piece][1].q
                widened[piece][steps, :2] += on_tool
                widened[piece][steps, 2:4] += on_joints
                widened[piece][steps, 4:] += self._joints_off(np.tile(on_joints, (len(q) - 1, 1)), q)[steps] + uneven
        for (row, path), tube in zip(paths, widened, strict=True):
            yield row, replace(path, tube=tube)

    def _uneven(self, seam: Seam, one: SeamPath, other: SeamPath, radius: float) -> tuple[Array, Array]:
        """By how much joints that move evenly in step may be off at a rounded corner, in [rad] or [m], shape (m,).

        They stay between both motions and the chord where the corner is left, whatever the curve. Beside that, by how
        much the part may so be moved and turned under the tool in [m] and [rad], shape (2,).
        """
        rates = [(path.q[-1] - path.q[0]) / max(path.shape.length, STANDS) for path in (one, other)]
        off = 0.5 * radius * np.abs(rates[1] - rates[0])
        off[: self._columns[self._robot.name].stop] = 0.0
        steps = one.q[-1] + np.vstack([np.zeros(len(off)), np.diag(off)[off > 0.0]])
        X_WP = np.broadcast_to(self._part_poses(seam, steps), (len(steps), 4, 4))
        X_WT = self._chain.tool_poses(one.q[-1:, self._columns[self._robot.name]])[0]
        X = X_WP @ inverse(X_WP[0]) @ X_WT
        turns = rotation_vector(X[:, :3, :3] @ X_WT[:3, :3].T)
        return off, np.array([float(np.linalg.norm(v, axis=1).sum()) for v in (X[:, :3, 3] - X_WT[:3, 3], turns)])


def _require_motion(cell: Cell, robot: Robot, task: str) -> None:
    """The tool goes on along its runs where its process is switched."""
    process, control = cell.task(task).process, robot.control
    for on, key in ((True, "on_lead_s"), (False, "off_lead_s")):
        has_run = process is not None and process.has_runs[0 if on else 1]
        if has_run and control is not None and not switches_in_motion(cell, task, on=on):
            raise LineRefusedError(
                task,
                f": expected controllers.{control.id}.process.{key} above 0, by which the motion itself switches the "
                "outputs beside a run, got 0: the tool would stop there; or write joints (--moves joints)",
            )


def _require_reached(robot: Robot, seam: Seam, q: Array, misses: Array, places: Array) -> None:
    """The tool meets every pose of a line, and no joint jumps on the way: the branch is the one continued."""
    steps = np.abs(np.diff(q, axis=0))
    jumps, missed = np.any(steps > LARGEST_STEP, axis=1), misses[1:] > 10.0 * POSE_TOL
    if np.any(jumps | missed):
        step = int(np.argmax(jumps | missed))
        joint = robot.model.joints[int(np.argmax(steps[step]))].name
        raise LineRefusedError(
            seam.task,
            f", {places[step + 1]:.1f} mm along its seam: no continuous motion of the joints follows the line, as "
            f"joint {joint} of '{robot.name}' passes near a singular configuration",
        )


def _require_lead(form: ProcessForm, seam: Seam, rows: RobotRows, ends: tuple[int, int], *, length: float) -> None:
    """A line or an arc takes longer than the time by which it switches an output ahead of its end."""
    is_on, is_on_behind = (rows.process is not None and bool(rows.process[row]) for row in ends)
    lead = form.entry.lead(on=is_on_behind) if is_on is not is_on_behind else 0.0
    feed = np.inf if rows.feeds is None else float(rows.feeds[ends[1]])
    if lead and lead * feed >= length:
        key = "on_lead_s" if is_on_behind else "off_lead_s"
        takes = f"the motion to that point takes, {MM * length:.4g} mm at {MM * feed:.4g} mm/s, got {lead:g}"
        raise LineRefusedError(seam.task, f": expected {key} below {length / feed:.3f}, which {takes}")


def _require_limits(robot: Robot, seam: Seam, q: Array, places: Array, *, feed: float, lengths: Array) -> None:
    """No joint leaves its limits, nor moves faster than it may while the tool moves at its speed."""
    model = robot.model
    beyond = np.maximum(model.lower - q, q - model.upper)
    if np.any(beyond > POSE_TOL):
        row, index = (int(place) for place in np.unravel_index(np.argmax(beyond), beyond.shape))
        unit, scale = model.joints[index].display_unit
        raise LineRefusedError(
            seam.task,
            f", {places[row]:.1f} mm along its seam: joint {model.joints[index].name} of '{robot.name}' leaves its "
            f"limits by {scale * float(beyond[row, index]):.3g} {unit}",
        )
    moved = np.diff(lengths)
    rates = np.abs(np.diff(q, axis=0))[moved > STANDS] * (feed / moved[moved > STANDS])[:, None]
    limits = model.velocity
    if rates.size and np.any(rates > (1.0 + SPEED_TOL) * limits):
        row, index = (int(place) for place in np.unravel_index(np.argmax(rates / limits), rates.shape))
        unit, scale = model.joints[index].display_unit
        raise LineRefusedError(
            seam.task,
            f", {places[1:][moved > STANDS][row]:.1f} mm along its seam: joint {model.joints[index].name} of "
            f"'{robot.name}' would move at {scale * float(rates[row, index]):.4g} {unit}/s at {MM * feed:.4g} mm/s, "
            f"allowed {scale * float(limits[index]):.4g}",
        )


def executed_programs(
    job: ExportJob, dialect: Dialect, full: Sequence[ProgramRows], read: Sequence[ProgramRows]
) -> tuple[ProgramRows, ...]:
    """Programs that were read, their seams as controllers execute them, at the times of the job that was written.

    Raises:
        InputError: A seam has no frame, or no speed.
        NotVerifiedError: Joints cannot follow a line: with the task, the length along its seam and the joint.
    """
    by_name: Mapping[str | None, ProgramRows] = {program.name: program for program in full}
    programs = []
    for meant, recovered in zip(job.programs, read, strict=True):
        shares = row_shares(job, meant)
        timed = {
            name: replace(
                rows,
                times=meant.robots[name].times if rows.times is None else rows.times,
                rounding=shares[name] if rows.rounding is None else rows.rounding,
            )
            for name, rows in recovered.robots.items()
        }
        timed_program = replace(recovered, robots=timed)
        robots = dict(timed)
        for rows in timed.values():
            if rows.seams:
                robots |= SeamExecution(job.frame, by_name[recovered.name], timed_program, rows, dialect=dialect).rows()
        programs.append(replace(recovered, robots=robots))
    return tuple(programs)
