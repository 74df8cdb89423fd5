"""Vargas, Leite and Costa 2012 beyond the three cases: the scalar filter, settings, singular starts, orientation, cost.

The simulations of this file are written from the equations alone; they share nothing with the program.
"""

from collections.abc import Callable

import numpy as np

from reproduction.runs import Array, Numbers
from reproduction.sheet import Sheet, draw
from reproduction.vargas import SETTLED, nearest

LENGTHS = np.array([2.0, 1.0, 1.0])  # [m] section 4
K_P, GAMMA = 5.0, 25.0  # [1/s] section 4
STEP = 0.001  # [s] as in the cells
CASE_2_S = 35.0  # [s]
START = np.array([-np.pi / 4, np.pi / 3, np.pi / 3])  # of cases II and III
SETTINGS = {  # of damped least squares: lambda_0 and w_0
    "printed": (0.3, 1.0),
    "lambda0_halved": (0.15, 1.0),
    "w0_halved": (0.3, 0.5),
}
GAINS = (5.0, 10.0, 25.0)  # [1/s] of the filter
OUT_OF_REACH = np.array([3.9, 0.3, np.pi / 2])  # place at the end of the reach with a hand across it
PREFERENCES = {"position": np.array([5.0, 5.0, 0.5]), "orientation": np.array([0.5, 0.5, 5.0])}  # [1/s]


def measure() -> Numbers:
    """Everything that the text says beside the figures of the three cases."""
    return {
        "scalar": _scalar(),
        "damping": {name: _damped(*setting) for name, setting in SETTINGS.items()},
        "gain": {f"{gain:g}": {law: _filtered(law, gain) for law in ("I", "II")} for gain in GAINS},
        "singular_start": _singular_starts(),
        "orientation": _orientation(),
        "unreachable": {name: _unreachable(gains) for name, gains in PREFERENCES.items()},
        "products": {
            "planar": products(2, 3),
            "four_robots": products(18, 24),
        },
    }


def products(m: int, n: int) -> Numbers:
    """Multiplications of one evaluation for m task rows and n joints; the update of the filter is one explicit step.

    Filtered inverse: ``Theta J``, ``J Theta``, ``S_l J^T``, ``J^T S_r``, the gain with the step, and ``Theta v``.
    Damped least squares: ``J J^T`` (its upper half), its Cholesky factor, two triangular solutions, ``J^T y``.
    """
    return {
        "filtered": float(2 * n * n * m + 2 * n * m * m + 2 * n * m),
        "damped": float(n * m * (m + 1) // 2 + m * (m + 1) * (m + 2) // 6 + m * (m + 1) + n * m),
    }


def _scalar() -> Numbers:
    """The filter of one function k, Eqs. 17 to 23: its time constant, and a k that falls to zero (figure 2)."""
    k, dt = 0.5, 1e-4
    theta, steps = 0.0, 0
    while theta < (1.0 - np.exp(-1.0)) / k:
        theta -= GAMMA * (k * theta - 1.0) * k * dt
        steps += 1
    c, k_0 = 0.25, 1.0
    a = GAMMA * np.sqrt(c) / (1.0 - np.sqrt(c))
    t: Array = np.asarray(dt * np.arange(200_001))
    falling = k_0 / np.sqrt(2.0 * a * t * k_0**2 + 1.0)
    result = np.empty_like(t)
    result[0] = (1.0 - np.sqrt(c)) / k_0
    for i, value in enumerate(falling[:-1]):
        result[i + 1] = result[i] - GAMMA * (value * result[i] - 1.0) * value * dt
    sheet = Sheet(1, 2)
    axes = sheet.panel("Eq. 23: k falls to zero", "time [s]", "k")
    draw(axes, t, {"": falling})
    draw(sheet.panel("plane of k and theta", "k", r"$\theta$"), falling, {"filter": result, "1/k": 1.0 / falling})
    sheet.save("vargas_filter")
    return {
        "time_constant_s": steps * dt,
        "expected_s": 1.0 / (GAMMA * k * k),
        "value_error": float(np.abs(falling * result - 1.0 + np.sqrt(c)).max()),
        "theta_at_end": result[-1],
        "closed_form_at_end": (1.0 - np.sqrt(c)) / falling[-1],
        "end_s": t[-1],
    }


def _damped(damping: float, region: float) -> Numbers:
    """Case II by damped least squares with other settings, Eqs. 9 and 10."""

    def velocities(J: Array, v: Array) -> Array:
        product = J @ J.T
        w = np.sqrt(max(np.linalg.det(product), 0.0))
        return J.T @ np.linalg.solve(product + damping * max(1.0 - w / region, 0.0) ** 2 * np.eye(2), v)

    return _case_2(velocities)


def _filtered(law: str, gain: float) -> Numbers:
    """Case II by a filtered inverse with another gain of the filter, Eqs. 34 to 36."""
    theta = np.zeros((3, 2))

    def velocities(J: Array, v: Array) -> Array:
        nonlocal theta
        u = theta @ v if law == "I" else theta @ (theta.T @ (J.T @ v))
        left, right = theta @ J - np.eye(3), J @ theta - np.eye(2)
        theta = theta - gain * STEP * (left @ J.T + J.T @ right)
        return u

    return _case_2(velocities)


def _case_2(velocities: Callable[[Array, Array], Array]) -> Numbers:
    """Error and nearness to the singular point in case II (Eq. 40) by Euler's method."""
    t = STEP * np.arange(round(CASE_2_S / STEP) + 1)
    desired = np.stack([1.1 + np.sin(0.2 * t), 0.35 * np.cos(0.2 * t)], axis=1)
    rates = np.stack([0.2 * np.cos(0.2 * t), -0.07 * np.sin(0.2 * t)], axis=1)
    q, places = START.copy(), np.empty_like(desired)
    for k in range(len(t)):
        places[k] = pose(q)[:2]
        q = q + STEP * velocities(jacobian(q, 2), rates[k] + K_P * (desired[k] - places[k]))
    settled = t >= SETTLED
    return {
        "error_mm": 1e3 * float(np.linalg.norm(desired - places, axis=1)[settled].max()),
        "nearest_mm": 1e3 * nearest(places[settled]),
    }


def pose(q: Array) -> Array:
    """Tip and angle of the hand (Eq. 38 and the sum of the joints), shape (3,)."""
    angles = np.cumsum(q)
    return np.array([LENGTHS @ np.cos(angles), LENGTHS @ np.sin(angles), angles[-1]])


def jacobian(q: Array, rows: int) -> Array:
    """Derivative of the first rows of the pose, shape (rows, 3)."""
    angles = np.cumsum(q)
    x, y = -LENGTHS * np.sin(angles), LENGTHS * np.cos(angles)
    return np.stack([np.cumsum(x[::-1])[::-1], np.cumsum(y[::-1])[::-1], np.ones(3)])[:rows]


def simulate(q: Array, theta: Array, goal: Array, *, feedback: Array, second_law: bool, duration: float) -> Array:
    """Joints at the end of Eqs. 34 and 35 or 36 by Euler's method, with a goal ``goal[0] + goal[1] t``, shape (3,)."""
    rows = len(feedback)
    for i in range(round(duration / STEP)):
        J = jacobian(q, rows)
        desired = goal[0] + goal[1] * i * STEP
        v = goal[1] + feedback * (desired - pose(q)[:rows])
        u = theta @ (theta.T @ (J.T @ v)) if second_law else theta @ v
        left, right = theta @ J - np.eye(3), J @ theta - np.eye(rows)
        theta = theta - GAMMA * STEP * (left @ J.T + J.T @ right)
        q = q + u * STEP
    return q


def _singular_starts() -> Numbers:
    """A stretched arm that has to come inwards, from a filter at zero and from independent columns, in [m]."""
    goal = np.array([[4.0, 0.0], [-0.1, 0.0]])
    whole = np.array([[1.0, 0.0], [-2.0, 0.0], [0.0, 1.0]])
    duration = 10.0
    result: Numbers = {}
    for name, theta in (("zero", np.zeros((3, 2))), ("chosen", whole)):
        for law, second in (("I", False), ("II", True)):
            end = simulate(np.zeros(3), theta, goal, feedback=np.full(2, K_P), second_law=second, duration=duration)
            result[f"{name}_{law}_m"] = float(np.linalg.norm(goal[0] + goal[1] * duration - pose(end)[:2]))
    return result


def _orientation() -> Numbers:
    """Position and orientation at once, both laws: the tip moves at 0.03 m/s, the hand turns by 0.05 rad/s."""
    goal = np.stack([pose(START) + np.array([0.1, 0.0, 0.0]), np.array([0.02, -0.02, -0.05])])
    result: Numbers = {}
    for law, second in (("I", False), ("II", True)):
        end = simulate(START, np.zeros((3, 3)), goal, feedback=np.full(3, K_P), second_law=second, duration=10.0)
        error = goal[0] + 10.0 * goal[1] - pose(end)
        result |= {f"{law}_mm": 1e3 * float(np.linalg.norm(error[:2])), f"{law}_rad": abs(float(error[2]))}
    return result


def _unreachable(feedback: Array) -> Numbers:
    """What is left after 30 s of a pose whose place and orientation cannot both be reached, by law II."""
    goal = np.stack([OUT_OF_REACH, np.zeros(3)])
    end = simulate(START, np.zeros((3, 3)), goal, feedback=feedback, second_law=True, duration=30.0)
    error = OUT_OF_REACH - pose(end)
    return {"position_m": float(np.linalg.norm(error[:2])), "orientation_rad": abs(float(error[2]))}
