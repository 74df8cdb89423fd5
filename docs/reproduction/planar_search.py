"""Nicolato 2007, sections 3.5, 4.4 and 5.4: a planar arm of three links by recursive search, and by a camera.

Kinematics only: joints are where the search puts them at the next sample. Motors, friction, backlash and joint
controllers of the thesis are left out. Written from the equations alone; it shares nothing with the program.
"""

import math
from collections.abc import Sequence

import numpy as np

from reproduction.runs import Array, Numbers
from reproduction.sheet import Sheet, draw, draw_joints

LENGTHS = np.full(3, 0.2)  # [m] table A.1
MODELLED = np.array([0.22, 0.19, 0.17])  # [m] sections 4.4 and 5.4.4
GOAL = np.array([0.3, 0.3])  # [m] section 5.4.1
TOLERANCE = 1e-9  # [m] section 5.4.3
ORDER = (2, 1, 0)  # of the joints, section 5.4.3
IN_ROW = (0, 1, 2)  # the same, section 4.2
MOST_ROUNDS = 2000  # [-] of one sample
CIRCLE = (np.array([0.3, 0.3]), 0.1, 2.0, 50.0)  # centre (ours) and radius in [m], period and length in [s]
SAMPLE_S = 0.01  # [s] of the circle; ours
FRAME_S, WATCHED_S = 0.04, 50.0  # [s] section 4.4
FOCUS, CENTRE, HEIGHT = 400.0, np.array([320.0, 240.0]), 1.2  # [px], [px] and [m] of the camera, Eqs. 4.3 and 4.4
FOCUS_MODELLED, HEIGHT_MODELLED = np.array([200.0, 300.0]), 1.1  # Eqs. 4.5 and 4.6
TARGET = np.array([240.0, 50.0])  # [px] section 4.4
NEARER = np.array([250.0, 70.0])  # [px] ours: within reach


def measure() -> Numbers:
    """A point from a singular start, the same with a weight, repeated circles, and a target in the image."""
    plain, rounds = search(np.zeros(3), GOAL, order=ORDER)
    weighted, weighted_rounds = search(np.zeros(3), GOAL, order=ORDER, shares=(0.5, 1.0, 1.0))
    stuck, _ = search(np.zeros(3), GOAL, order=IN_ROW)
    reach = float(LENGTHS.sum())
    return {
        "point": {
            "error_m": float(np.linalg.norm(tip(plain) - GOAL)),
            "rounds": float(rounds),
            "joints_deg": np.rad2deg(plain),
        },
        "weighted": {
            "error_m": float(np.linalg.norm(tip(weighted) - GOAL)),
            "rounds": float(weighted_rounds),
            "joints_deg": np.rad2deg(weighted),
        },
        "other_order_error_m": float(np.linalg.norm(tip(stuck) - GOAL)),
        "circles": _circles(),
        "target": {
            "distance_m": float(np.linalg.norm(seen_at(TARGET))),
            "reach_m": reach,
            "out_of_reach_px": (float(np.linalg.norm(seen_at(TARGET))) - reach) * FOCUS / HEIGHT,
        },
        "camera": {
            "printed": _watched(TARGET, IN_ROW),
            "nearer": _watched(NEARER, IN_ROW),
            "other_order": _watched(NEARER, ORDER),
            "other_order_half": _watched(NEARER, ORDER, share=0.5),
        },
        "brake": [brake(angle) for angle in (0.0, 0.5, 1.0)],
    }


def brake(angle: float, limit: float = 1.0) -> float:
    """Share of a move that is made at an angle between limits of both signs (Eq. 3.29)."""
    return 4.0 * (limit - angle) * (angle + limit) / (2.0 * limit) ** 2


def tip(q: Array, lengths: Array = LENGTHS) -> Array:
    """Place of the tip, shape (2,)."""
    angles = np.cumsum(q)
    return np.array([lengths @ np.cos(angles), lengths @ np.sin(angles)])


def search(
    q: Array,
    goal: Array,
    *,
    order: Sequence[int],
    lengths: Array = LENGTHS,
    shares: Sequence[float] = (1.0, 1.0, 1.0),
) -> tuple[Array, int]:
    """Recursive search of section 3.4: the joints move in a fixed order, each by a share of its own best move.

    Returns:
        The joints, and the number of rounds; the search ends within the tolerance, or where no joint gains any more.
    """
    joints, sizes = q.tolist(), lengths.tolist()
    for done in range(MOST_ROUNDS):
        end = _points(joints, sizes)[-1]
        if math.hypot(goal[0] - end[0], goal[1] - end[1]) <= TOLERANCE:
            return np.array(joints), done
        moved = 0.0
        for joint in order:
            points = _points(joints, sizes)
            (x, y), (end_x, end_y) = points[joint], points[-1]
            arm, desired = (end_x - x, end_y - y), (float(goal[0]) - x, float(goal[1]) - y)
            turn = math.atan2(arm[0] * desired[1] - arm[1] * desired[0], arm[0] * desired[0] + arm[1] * desired[1])
            joints[joint] += shares[joint] * turn
            moved = max(moved, abs(turn))
        if moved < TOLERANCE:
            return np.array(joints), done + 1
    return np.array(joints), MOST_ROUNDS


def _points(joints: Sequence[float], lengths: Sequence[float]) -> list[tuple[float, float]]:
    """Places of all joints and of the tip."""
    points, angle = [(0.0, 0.0)], 0.0
    for turn, length in zip(joints, lengths, strict=True):
        angle += turn
        x, y = points[-1]
        points.append((x + length * math.cos(angle), y + length * math.sin(angle)))
    return points


def _circles() -> Numbers:
    """Circles at 0.5 Hz from the stretched arm, joints in the order 3, 2, 1 (section 5.4.3)."""
    center, radius, period, length = CIRCLE
    t: Array = np.asarray(SAMPLE_S * np.arange(round(length / SAMPLE_S) + 1))
    angles = 2.0 * np.pi * t / period
    goals = center + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    result = np.zeros((len(t), 3))
    for k, goal in enumerate(goals):
        result[k], _ = search(result[max(k - 1, 0)], goal, order=ORDER)
    errors = np.linalg.norm([tip(q) for q in result] - goals, axis=1)
    cycle = round(period / SAMPLE_S)
    drift = np.rad2deg(np.abs(result[cycle:] - result[:-cycle])).max(axis=1)
    sheet = Sheet(1, 2)
    axes = sheet.panel("circles by search: joints", "time [s]", "[deg]")
    draw_joints(axes, t, np.rad2deg(result), (r"$\theta_1$", r"$\theta_2$", r"$\theta_3$"))
    draw(sheet.panel("change from one cycle to the next", "time [s]", "[deg]"), t[cycle:], {"": drift})
    sheet.save("nicolato_circles")
    return {
        "error_m": errors.max(),
        "first_drift_deg": drift[: cycle + 1].max(),
        "last_drift_deg": drift[-cycle:].max(),
    }


def seen_at(pixels: Array) -> Array:
    """Place on the table in [m] that the camera of Eqs. 4.3 and 4.4 sees at given pixels."""
    x, y = (pixels - CENTRE) * HEIGHT / FOCUS
    return np.array([-y, -x])


def pixels_of(place: Array) -> Array:
    """Where that camera sees a place on the table."""
    return CENTRE + FOCUS / HEIGHT * np.array([-place[1], -place[0]])


def believed(difference: Array) -> Array:
    """Distance in [m] that the inverse of the modelled camera gives to a difference in pixels, g of Eq. 3.31."""
    x, y = difference * HEIGHT_MODELLED / FOCUS_MODELLED
    return np.array([-y, -x])


def _watched(target: Array, order: Sequence[int], share: float = 1.0) -> Numbers:
    """A target in the image, by Eq. 3.31 with wrong links and a wrong camera; and without the camera's correction.

    The share is the part of each correction that is made.
    """
    q = np.zeros(3)
    errors = []
    for _ in range(round(WATCHED_S / FRAME_S) + 1):
        seen = pixels_of(tip(q))
        errors.append(float(np.linalg.norm(target - seen)))
        q, _ = search(q, share * believed(target - seen) + tip(q, MODELLED), order=order, lengths=MODELLED)
    modelled, _ = search(np.zeros(3), seen_at(target), order=order, lengths=MODELLED)
    late = np.array(errors) > 1.0
    return {
        "error_px": errors[-1],
        "within_a_pixel_after_s": FRAME_S * float(np.flatnonzero(late)[-1] + 1) if errors[-1] <= 1.0 else -1.0,
        "uncorrected_px": float(np.linalg.norm(target - pixels_of(tip(modelled)))),
    }
