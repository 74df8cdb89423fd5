"""Ribeiro 2010, Appendices C, D and E in the plane: Davies' method by the printed equations, and Euler's drift.

Written from the equations alone; it shares nothing with the program.
"""

from collections.abc import Callable

import numpy as np

from reproduction.runs import Array, Numbers
from reproduction.sheet import Sheet, draw

LENGTHS = np.array([0.5, 0.4, 0.2])  # [m] as `planar_3r`; the thesis gives none
STEP = 0.001  # [s]
Model = Callable[[Array], tuple[Array, Array]]  # screws of all joints and pose of the tool, at given joints
GAIN = 500.0  # [1/s]
ALONE_S, TOGETHER_S = 40.0, 12.0  # [s] Appendix D and Appendix E
START = np.deg2rad([70.0, -95.0, 40.0])
HELD_START = np.deg2rad([50.0, -85.0, 35.0])  # of the arm that holds the part
GRASP = np.array([0.12, 0.0, 0.0])  # [m, m, rad] part in the gripper
APART = np.array([1.9, 0.3, np.pi])  # [m, m, rad] base of the second arm in that of the first

# A pose in the plane is (x, y, angle); speeds of the virtual joints are in the order Rz, Py, Px of the thesis.


def measure() -> Numbers:
    """Appendix C: the Jacobian; Appendix D: one arm for 40 s; Appendix E: two arms for 12 s; each with its drift."""
    free, fed = (_errors(_follow_alone(gain)) for gain in (0.0, GAIN))
    free_pair, fed_pair = (_errors(_follow_together(gain)) for gain in (0.0, GAIN))
    _draw(free, fed, free_pair, fed_pair)
    return {
        "jacobian": _jacobian_gaps(),
        "alone": {"euler": _numbers(free), "feedback": _numbers(fed), "double_step": _numbers(_errors(_double_step()))},
        "together": {"e15": _numbers(free_pair), "e16": _numbers(fed_pair)},
    }


def placed(base: Array, pose: Array) -> Array:
    """A pose given in a base frame, in the frame of that base."""
    c, s = np.cos(base[2]), np.sin(base[2])
    x, y, angle = pose
    return np.array([base[0] + c * x - s * y, base[1] + s * x + c * y, base[2] + angle])


def inverted(pose: Array) -> Array:
    """The base frame as seen from a pose."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([-c * pose[0] - s * pose[1], s * pose[0] - c * pose[1], -pose[2]])


def arm(q: Array) -> tuple[Array, Array]:
    """Points of the three joint axes, shape (3, 2), and pose of the tool, in the base frame."""
    angles = np.cumsum(q)
    ends = np.cumsum(LENGTHS[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1), axis=0)
    return np.vstack([np.zeros((1, 2)), ends[:2]]), np.array([*ends[2], angles[2]])


def screws(points: Array, sign: float = 1.0) -> Array:
    """Columns (s_z, s_0y s_z, -s_0x s_z) of Eqs. C.16 and E.9, shape (3, n)."""
    return sign * np.stack([np.ones(len(points)), points[:, 1], -points[:, 0]])


def virtual(pose: Array) -> Array:
    """N_p of the PPR chain, Eq. E.8."""
    return np.array([[1.0, 0.0, 0.0], [pose[1], 0.0, 1.0], [-pose[0], 1.0, 0.0]])


def virtual_as_printed(pose: Array) -> Array:
    """N_p as Eq. C.19 prints it."""
    return np.array([[1.0, 0.0, 1.0], [pose[1], 1.0, 0.0], [-pose[0], 0.0, 0.0]])


def relative(q: Array) -> tuple[Array, Array]:
    """Screws of both arms in the part, the holder's reversed, shape (3, 6), and pose of the tool in the part."""
    held_points, gripper = arm(q[:3])
    in_part = inverted(placed(gripper, GRASP))
    points, tool = arm(q[3:])
    base = placed(in_part, APART)

    def moved(frame: Array, given: Array) -> Array:
        return np.array([placed(frame, np.array([*point, 0.0]))[:2] for point in given])

    N_s = np.hstack([screws(moved(in_part, held_points), -1.0), screws(moved(base, points))])
    return N_s, placed(base, tool)


def _jacobian_gaps() -> Numbers:
    """Largest difference of N_p^-1 N_s from central differences of the tool's pose, by both forms of N_p."""
    size = 1e-6
    by_differences = np.stack(
        [(arm(START + size * axis)[1] - arm(START - size * axis)[1]) / (2 * size) for axis in np.eye(3)], axis=1
    )[[2, 1, 0]]
    points, tool = arm(START)
    return {
        name: float(np.abs(np.linalg.solve(form(tool), screws(points)) - by_differences).max())
        for name, form in (("e8", virtual), ("c19", virtual_as_printed))
    }


def _circle(t: Array, *, center: Array, radius: float, period: float, turn: float) -> tuple[Array, Array]:
    """Poses on a circle that is travelled once, and speeds in the order Rz, Py, Px, shapes (N, 3)."""
    angle = 2.0 * np.pi * t / period
    rate = 2.0 * np.pi / period
    pose = np.stack(
        [center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle), center[2] + turn * t / period], axis=1
    )
    speed = np.stack(
        [np.full_like(t, turn / period), radius * rate * np.cos(angle), -radius * rate * np.sin(angle)], axis=1
    )
    return pose, speed


def _integrate(q: Array, poses: Array, velocities: Array, gain: float, dt: float, model: Model) -> Array:
    """Eqs. D.4 and E.15 without gain, D.11 and E.16 with it; errors x, y, angle at every sample, shape (N, 3).

    Without feedback N_p is that of the desired pose, with it that of the actual one, as printed.
    """
    errors = np.empty_like(poses)
    for k, (desired, speed) in enumerate(zip(poses, velocities, strict=True)):
        N_s, actual = model(q)
        errors[k] = desired - actual
        N_p = virtual(actual if gain else desired)
        J = np.linalg.solve(N_p, N_s)
        q = q + J.T @ np.linalg.solve(J @ J.T, speed + gain * errors[k][[2, 1, 0]]) * dt
    return errors


def _follow_alone(gain: float, dt: float = STEP) -> Array:
    """One arm on a circle of 0.1 m for 40 s, while its tool turns evenly by 60 deg (Appendix D)."""

    def model(q: Array) -> tuple[Array, Array]:
        points, tool = arm(q)
        return screws(points), tool

    t: Array = np.asarray(dt * np.arange(round(ALONE_S / dt) + 1))
    center = arm(START)[1] - [0.1, 0.0, 0.0]
    poses, velocities = _circle(t, center=center, radius=0.1, period=ALONE_S, turn=np.pi / 3)
    return _integrate(START, poses, velocities, gain, dt, model)


def _double_step() -> Array:
    """The same without feedback at twice the step: a drift of first order is twice as large."""
    return _follow_alone(0.0, 2.0 * STEP)


def _follow_together(gain: float) -> Array:
    """Two arms, the second on a circle on the part of the first, for 12 s (Appendix E)."""
    q = np.array([*HELD_START, *np.deg2rad([-40.0, 75.0, -30.0])])
    t: Array = np.asarray(STEP * np.arange(round(TOGETHER_S / STEP) + 1))
    center = relative(q)[1] - [0.1, 0.0, 0.0]
    poses, velocities = _circle(t, center=center, radius=0.1, period=TOGETHER_S, turn=np.pi / 3)
    return _integrate(q, poses, velocities, gain, STEP, relative)


def _errors(result: Array) -> tuple[Array, Array]:
    """Distance in [mm] and angle in [rad] at every sample."""
    return 1e3 * np.linalg.norm(result[:, :2], axis=1), np.abs(result[:, 2])


def _numbers(result: tuple[Array, Array]) -> Numbers:
    """Largest and last error."""
    return {"error_mm": result[0].max(), "end_mm": result[0][-1], "turn_below_1e_12_rad": bool(result[1].max() < 1e-12)}


def _draw(*result: tuple[Array, Array]) -> None:
    """Errors without and with feedback, one arm and two."""
    sheet = Sheet(1, 2)
    for (free, fed), what, length in (
        (result[:2], "one arm, 40 s", ALONE_S),
        (result[2:], "two arms, 12 s", TOGETHER_S),
    ):
        t = np.linspace(0.0, length, len(free[0]))
        axes = sheet.panel(f"{what}: position error", "time [s]", "[mm]")
        draw(axes, t[1:], {"without feedback": free[0][1:], "with feedback": fed[0][1:]})
        axes.set_yscale("log")
    sheet.save("ribeiro_drift")
