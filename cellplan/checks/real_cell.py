"""Rehearsed cells: where their tools are by commanded positions, their true errors, and the figures of ISO 9283:1998.

The standard repeats the runs of one robot. Here the runs are trials: real cells drawn from stated distributions. The
figures have the standard's names and formulae, and are to be called AP-, RP-, AT- and RT-style.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse, rotation_exp, transform_points
from cellplan.measures.tool_errors import part_poses, pose_accuracy, relative_to_task_frame
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.rehearsal import PathFigures, PoseFigures, RunRehearsal
from cellplan.model.report.report import Check, TaskAccuracy
from cellplan.model.settings.cell_errors import CameraEntry, CameraModelEntry, MeasurementEntry
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import DEGREES, MILLIMETRES
from cellplan.scene.kinematics.screw_chain import ScrewChain

KINDS: Final = (("position", MILLIMETRES), ("orientation", DEGREES))


class RealCell:
    """A cell with its real geometry, which executes commanded joint positions.

    Its kinematics is that of successive screw displacements, which no planner uses.
    """

    def __init__(self, cell: Cell) -> None:
        """Build the chains of the robots."""
        self._cell = cell
        self._chains = {robot.name: ScrewChain(robot) for robot in cell.robots}

    def tool_poses(self, tasks: Sequence[Task], q: Array) -> tuple[Array, ...]:
        """Tool tips of some tasks on the part, or in the world where a task is given there.

        Args:
            tasks: The tasks.
            q: Stacked joint positions in [rad] or [m], shape (N, nq).

        Returns:
            Poses X_PT, shape (N, 4, 4) each.
        """
        positions = self._positions(q)
        X_WP = part_poses(self._cell, self._chains, positions)
        tips = ((task, self._chains[task.robot].tool_poses(positions[task.robot])) for task in tasks)
        return tuple(relative_to_task_frame(task, X_WT, X_WP) for task, X_WT in tips)

    def measured(
        self, desired: Sequence[tuple[Task, Array]], q: Array, system: MeasurementEntry, rng: np.random.Generator
    ) -> tuple[Array, ...]:
        """Measurements of the tools of some tasks, shape (N, 4, 4) each.

        Args:
            desired: The tasks with their desired poses X_PT, shape (N, 4, 4).
            q: Stacked joint positions in [rad] or [m], shape (N, nq).
            system: What measures.
            rng: Its noise; without noise no number is taken.

        Raises:
            InputError: A tip is behind the camera.
        """
        true = self.tool_poses([task for task, _ in desired], q)
        if system.camera is None:
            return measured_poses(true, system, rng)
        X_WP = part_poses(self._cell, self._chains, self._positions(q))
        return tuple(
            seen_poses(system.camera, X_W, goals, X_PT, rng)
            for X_PT, (task, goals) in zip(true, desired, strict=True)
            for X_W in [np.eye(4)[None] if task.relative_to is Frame.WORLD else X_WP]
        )

    def accuracy(self, schedule: Schedule, q: Array) -> tuple[TaskAccuracy, ...]:
        """True errors of all tasks of a schedule, for stacked joint positions of shape (N, nq)."""
        poses = self.tool_poses([scheduled.task for scheduled in schedule.tasks], q)
        return tuple(pose_accuracy(scheduled, X_PT) for scheduled, X_PT in zip(schedule.tasks, poses, strict=True))

    def _positions(self, q: Array) -> dict[str, Array]:
        """Stacked positions, shape (N, nq), by robot."""
        return {robot.name: q[:, self._cell.columns(robot.name)] for robot in self._cell.robots}


def seen_poses(camera: CameraEntry, X_WP: Array, desired: Array, actual: Array, rng: np.random.Generator) -> Array:
    r"""Poses at which corrections take tools to be that a camera sees, shape (N, 4, 4).

    It shows the difference of pixels ``r_d - r_n`` between desired and actual tips. The camera that corrections believe
    in makes of it, at the depth of the desired tip, the displacement ``g(r_d - r_n)`` across its view ([Nicolato2007]_
    Eq. 3.31). The tool is taken to stand that far from its desired pose, and to be turned as desired.

    Args:
        camera: The camera.
        X_WP: The frame of the task, shape (N, 4, 4) or (1, 4, 4).
        desired: Desired poses in it, shape (N, 4, 4).
        actual: Actual ones, shape (N, 4, 4).
        rng: Noise of columns and rows.

    Raises:
        InputError: A tip is behind the camera.
    """
    goals, tips = ((X_WP @ X)[:, :3, 3] for X in (desired, actual))
    difference = pixels(camera, goals) - pixels(camera, tips)
    if camera.noise_px > 0.0:
        difference -= camera.noise_px * rng.standard_normal(difference.shape)
    believed = camera.believed or camera
    depth = transform_points(inverse(believed.at.matrix), goals)[:, 2:]
    shift_W = difference * depth / np.array(believed.focal_px) @ believed.at.matrix[:3, :2].T
    seen = desired.copy()
    seen[:, :3, 3] -= (np.swapaxes(X_WP[:, :3, :3], 1, 2) @ shift_W[..., None])[..., 0]
    return seen


def pixels(camera: CameraModelEntry, points_W: Array) -> Array:
    """Column and row at which a camera sees points in the world in [m], shape (N, 3) to (N, 2).

    Raises:
        InputError: A point is not in front of it.
    """
    points = transform_points(inverse(camera.at.matrix), points_W)
    if not (points[:, 2] > 0.0).all():
        raise InputError("measurement.camera.at: expected all tips in front of the camera, got one behind it")
    return np.array(camera.centre_px) + np.array(camera.focal_px) * points[:, :2] / points[:, 2:]


def measured_poses(X_PT: Sequence[Array], system: MeasurementEntry, rng: np.random.Generator) -> tuple[Array, ...]:
    """Measurements of tool poses on the part, shape (N, 4, 4) each.

    Each coordinate of the tip in P, and each component of a small turn about the axes of P, has normal noise of its
    own. Without noise no number is taken from the generator.
    """
    return tuple(_measured(poses, system, rng) for poses in X_PT)


def _measured(X_PT: Array, system: MeasurementEntry, rng: np.random.Generator) -> Array:
    """Poses of one tool with noise."""
    measured = X_PT.copy()
    if system.position_noise_mm > 0.0:
        measured[:, :3, 3] += system.position_noise_mm.si * rng.standard_normal((len(measured), 3))
    if system.orientation_noise_deg > 0.0:
        turns = rotation_exp(system.orientation_noise_deg.si * rng.standard_normal((len(measured), 3)))
        measured[:, :3, :3] = turns @ measured[:, :3, :3]
    return measured


def pose_figures(errors: Array, at_s: float) -> PoseFigures:
    r"""Pose accuracy AP and pose repeatability RP at one programmed pose (ISO 9283:1998, clause 7.2).

    With the attained positions ``p_j`` of n trials, their barycentre ``m`` and the commanded position ``p_c``

    .. math:: AP_p = |m - p_c|, \quad AP_a = \bar a - a_c, \quad l_j = |p_j - m|, \quad RP_l = \bar l + 3 S_l,
              \quad RP_a = \pm 3 S_a

    with the standard deviations ``S`` over ``n - 1``; likewise b and c. The angles a, b and c are the components of the
    small turn between attained and commanded orientation about x, y and z of the part.

    Args:
        errors: Commanded less attained pose of each trial in P: position in [m], then turn in [rad], shape (T, 6).
        at_s: Instant of the pose in [s].
    """
    accuracy = np.abs(errors.mean(axis=0))
    distance = float(np.linalg.norm(errors[:, :3].mean(axis=0)))
    if len(errors) < 2:
        return PoseFigures(at_s=at_s, AP_p=distance, AP_abc=_three(accuracy[3:]), RP_l=None, RP_abc=None)
    spread, turns = _repeatability(errors[:, None, :])
    return PoseFigures(
        at_s=at_s, AP_p=distance, AP_abc=_three(accuracy[3:]), RP_l=float(spread[0]), RP_abc=_three(turns[0])
    )


def path_figures(errors: Array, times: Array) -> PathFigures:
    r"""Path accuracy AT and path repeatability RT of one task (ISO 9283:1998, clauses 8.2 and 8.3).

    .. math:: AT_p = \max_i |m_i - p_{ci}|, \quad AT_a = \max_i |\bar a_i - a_{ci}|, \quad
              RT_p = \max_i (\bar l_i + 3 S_{l i}), \quad RT_a = \max_i 3 S_{a i}

    with the symbols of `pose_figures` at each point i of the path; likewise b and c. The standard compares points in
    planes across the path. Here they are compared at the same instant, so that an error along the path counts too: the
    figures are never smaller than those of the standard.

    Args:
        errors: Commanded less attained pose in P: position in [m], then turn in [rad], shape (T, N, 6).
        times: Times in [s], shape (N,).
    """
    mean = errors.mean(axis=0)
    distances = np.linalg.norm(mean[:, :3], axis=1)
    worst = int(np.argmax(distances))
    turns = np.abs(mean[:, 3:]).max(axis=0)
    AT_p, AT_at_s = float(distances[worst]), float(times[worst])
    if len(errors) < 2:
        return PathFigures(AT_p=AT_p, AT_p_at_s=AT_at_s, AT_abc=_three(turns), RT_p=None, RT_p_at_s=None, RT_abc=None)
    spread, turn_spread = _repeatability(errors)
    widest = int(np.argmax(spread))
    return PathFigures(
        AT_p=AT_p,
        AT_p_at_s=AT_at_s,
        AT_abc=_three(turns),
        RT_p=float(spread[widest]),
        RT_p_at_s=float(times[widest]),
        RT_abc=_three(turn_spread.max(axis=0)),
    )


def _repeatability(errors: Array) -> tuple[Array, Array]:
    """``l + 3 S_l`` in [m], shape (N,), and three standard deviations of the turns in [rad], shape (N, 3)."""
    spread = errors - errors.mean(axis=0)
    lengths = np.linalg.norm(spread[..., :3], axis=2)
    radii: Array = lengths.mean(axis=0) + 3.0 * lengths.std(axis=0, ddof=1)
    turns: Array = 3.0 * spread[..., 3:].std(axis=0, ddof=1)
    return radii, turns


def _three(values: Array) -> tuple[float, float, float]:
    """Three plain numbers."""
    a, b, c = (float(value) for value in values)
    return a, b, c


def largest(errors: Array, first: int) -> float:
    """Largest length of error vectors, shape (N, 3), from a sample on."""
    return float(np.linalg.norm(errors[first:], axis=1).max())


def worst_share(cell: Cell, accuracy: Sequence[TaskAccuracy], judged_from: Mapping[str, int]) -> float:
    """Largest error of all tasks as a share of its tolerance; an error where none is allowed is infinite."""
    shares = [0.0]
    for errors in accuracy:
        tolerance, first = cell.task(errors.task).tolerance, judged_from[errors.task]
        for error, allowed in (
            (largest(errors.position_error, first), tolerance.position_mm.si),
            (largest(errors.orientation_error, first), tolerance.orientation_deg.si),
        ):
            shares.append(error / allowed if allowed > 0.0 else np.inf if error > 0.0 else 0.0)
    return max(shares)


def check_true_errors(cell: Cell, run: RunRehearsal) -> tuple[Check, ...]:
    """Position and orientation error of each task of a run, at its worst over all trials, against its tolerance."""
    return tuple(
        _check(cell, run, place, kind) for place in range(len(run.trials[0].final)) for kind in range(len(KINDS))
    )


def _check(cell: Cell, run: RunRehearsal, place: int, kind: int) -> Check:
    """One error of one task."""
    name, (unit, scale) = KINDS[kind]
    errors = [trial.final[place] for trial in run.trials]
    task = cell.task(errors[0].task)
    first = run.judged_from[task.name]
    series = np.stack(
        [np.linalg.norm((error.position_error, error.orientation_error)[kind][first:], axis=1) for error in errors]
    )
    trial, sample = np.unravel_index(int(np.argmax(series)), series.shape)
    value, at_s = scale * float(series[trial, sample]), float(run.times[first + sample])
    limit = scale * (task.tolerance.position_mm.si, task.tolerance.orientation_deg.si)[kind]
    after = " after correction" if run.trials[0].correction is not None else ""
    which = f" in trial {trial + 1} of {len(errors)}" if len(errors) > 1 else ""
    message = (
        f"true {name} error of task '{task.name}'{after}: {value:.3g} {unit} at {at_s:.3f} s{which}, "
        f"allowed {limit:g} {unit}"
    )
    return Check(
        f"true_{name}_error", task.name, value <= limit, message, value=value, limit=limit, unit=unit, at_s=at_s
    )
