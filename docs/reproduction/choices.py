"""Settings that the texts leave open: what each choice of them would give, and so which of them fit what is printed."""

import itertools

import numpy as np

from reproduction.runs import Array, Numbers, curves, paper_cell
from reproduction.vargas import METHODS, SETTLED, nearest

LINKS = np.array([2.0, 1.0, 1.0])  # [m] arm of Vargas
STARTS = {"case_1": (np.pi / 8, (2.0, 0.5)), "case_2": (np.pi / 4, (1.1, 0.35)), "case_3": (np.pi / 4, (2.0, 2.0))}
MIRRORED = {"robots.arm.start_deg": [45.0, -60.0, -60.0]}
DIAMETER, CIRCLE_S = 3.0**0.5, 6.0  # [m] and [s], Nicolato 2007, section 4.1
REGION = 0.04  # epsilon of Eq. 2.12
TILTS = tuple(range(0, 91, 15))  # [deg] of the plane of the circle about the x axis, from xz to xy
HALVES = (0.1, 0.2)  # [m] half axes of the ellipse along x and y, section 4.2
ELLIPSE_START = np.array([np.pi / 3, np.pi / 3, -np.pi / 2, -np.pi / 2])
LINK, CYCLE_S, CYCLES, STEP_S, GAIN = 0.2, 2.0, 25, 0.001, 100.0


def measure() -> Numbers:
    """Signs of Vargas's start, plane of Nicolato's circle, centre and sense of his ellipse."""
    return {"signs": _signs(), "plane": _planes(), "ellipse": _ellipses()}


def _signs() -> Numbers:
    """Distances from the start of the path for all signs of the start; and both late cases from the mirrored one."""
    result: Numbers = {}
    for case, (first, path) in STARTS.items():
        angles = np.array([first, np.pi / 3, np.pi / 3]) * np.array(list(itertools.product((1, -1), repeat=3)))
        sums = np.cumsum(angles, axis=1)
        tips = np.stack([np.cos(sums) @ LINKS, np.sin(sums) @ LINKS], axis=1)
        result[case] = {"distances_m": np.sort(np.linalg.norm(tips - np.array(path), axis=1))}
    for case in (2, 3):
        result[f"case_{case}"] |= {method: _mirrored(case, method) for method in METHODS}
    return result


def _mirrored(case: int, method: str) -> Numbers:
    """One case from the mirror image of its start: error, distance from the singular point, and speed."""
    run = curves(paper_cell(f"vargas_case_{case}", method=method, values=MIRRORED))
    return {
        "error_mm": 1e3 * run.error[run.after(SETTLED)].max(),
        "nearest_mm": 1e3 * nearest(run.actual[run.after(SETTLED)]),
        "speed_rad_s": np.abs(run.qd).max(),
    }


def _planes() -> Numbers:
    """Instant in [s] at which damping sets in on the circle, by tilt of its plane in [deg]."""
    t = 0.01 * np.arange(301)
    share = t / CIRCLE_S
    angle = 2.0 * np.pi * (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5)
    x, across = 0.5 * DIAMETER * (1.0 + np.cos(angle)), 0.5 * DIAMETER * np.sin(angle)
    return {
        f"{tilt}": float(
            t[smallest_singular(x, across * np.sin(np.deg2rad(tilt)), across * np.cos(np.deg2rad(tilt))) < REGION][0]
        )
        for tilt in TILTS
    }


def smallest_singular(x: Array, y: Array, z: Array) -> Array:
    """Smallest singular value of two links of 1 m on a turning shoulder, with the tip at places of shape (N,).

    The shoulder moves the tip across the plane of the links, by its distance from the axis; the links move it within
    that plane. Seen from the second link, that is (sin b, 1 + cos b) and (0, 1), with the angle b of the elbow.
    """
    from_axis = np.hypot(x, y)
    elbow = np.arccos(np.clip((from_axis**2 + z**2 - 2.0) / 2.0, -1.0, 1.0))
    J = np.zeros((len(elbow), 2, 2))
    J[:, 0, 0], J[:, 1, 0], J[:, 1, 1] = np.sin(elbow), 1.0 + np.cos(elbow), 1.0
    return np.asarray(np.minimum(from_axis, np.linalg.svd(J, compute_uv=False)[:, -1]))


def _ellipses() -> Numbers:
    """Largest drift in a cycle in [deg] with the pseudo-inverse, by start and sense of the ellipse."""
    begins = np.deg2rad(np.repeat([0.0, 90.0, 180.0, 270.0], 2))
    senses = np.tile([1.0, -1.0], 4)
    q = np.tile(ELLIPSE_START, (8, 1))
    start = _tips(q)
    cycle = round(CYCLE_S / STEP_S)
    ends = [q]
    for number in range(CYCLES * cycle):
        angle = begins + senses * 2.0 * np.pi * (number % cycle) / cycle
        goal = start + _on_ellipse(angle) - _on_ellipse(begins)
        speed = senses[:, None] * 2.0 * np.pi / CYCLE_S * _along_ellipse(angle)
        q = q + STEP_S * _resolved(q, speed + GAIN * (goal - _tips(q)))
        if (number + 1) % cycle == 0:
            ends.append(q)
    drifts = np.rad2deg(np.abs(np.diff(ends, axis=0)).max(axis=(0, 2)))
    names = [f"{begin:g}{'+' if sense > 0 else '-'}" for begin, sense in zip(np.rad2deg(begins), senses, strict=True)]
    readings = dict(zip(names, drifts, strict=True))
    return {"least_other": drifts[1:].min(), "most_other": drifts[1:].max(), "by_reading": readings}


def _on_ellipse(angle: Array) -> Array:
    """Places on the ellipse about its centre, shape (N, 2)."""
    return np.stack([HALVES[0] * np.cos(angle), HALVES[1] * np.sin(angle)], axis=1)


def _along_ellipse(angle: Array) -> Array:
    """Derivative of the same by the angle."""
    return np.stack([-HALVES[0] * np.sin(angle), HALVES[1] * np.cos(angle)], axis=1)


def _tips(q: Array) -> Array:
    """Tips of arms of four links, shape (N, 2)."""
    angles = np.cumsum(q, axis=1)
    return LINK * np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)], axis=1)


def _resolved(q: Array, speed: Array) -> Array:
    """Smallest joint velocities with which the tips move so, shape (N, 4)."""
    angles = np.cumsum(q, axis=1)
    links = LINK * np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    J = np.cumsum(links[:, :, ::-1], axis=2)[:, :, ::-1]  # a joint moves all links from its own on
    turned = np.swapaxes(J, 1, 2)
    return np.asarray((turned @ np.linalg.solve(J @ turned, speed[:, :, None]))[:, :, 0])
