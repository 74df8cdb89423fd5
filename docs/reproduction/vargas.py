"""Vargas, Leite and Costa 2012, section 4: three paths of a planar arm, each by three methods."""

import numpy as np

from reproduction.runs import Array, Curves, Numbers, curves, paper_cell
from reproduction.sheet import Sheet, draw, draw_joints, path_curve

METHODS = {
    "filtered_inverse": "filtered inverse I",
    "filtered_inverse_ii": "filtered inverse II",
    "damped_least_squares": "DLS",
}
SETTLED = 5.0  # [s] 25 time constants of the feedback: what is left of the start error is rounding
PASSED_BY = 30.0  # [s] half of the way from the singular point of case III to its end is behind the arm
OTHER_READING = "squared_vargas_damping"  # lambda^2 I in Eq. 9
NAMES = ("$q_1$", "$q_2$", "$q_3$")
ERRORS = {1: (-0.1, 0.6), 2: (-0.05, 0.3), 3: (-0.1, 0.6)}  # [m] axes of figures 6, 10 and 14
ZOOMS = {2: ((0.05, 0.23), (-0.15, 0.15)), 3: ((-0.4, 0.3), (-0.4, 0.3))}  # [m] x and y of figures 9 and 13


def measure(case: int) -> Numbers:
    """Solve one case by all methods, draw it and say what comes out."""
    result = {method: curves(paper_cell(f"vargas_case_{case}", method=method)) for method in METHODS}
    _draw(case, result)
    numbers: Numbers = {method: _of_one(run) for method, run in result.items()}
    settled = result["damped_least_squares"].after(SETTLED)
    places = np.stack([run.actual[settled] for run in result.values()])
    numbers["apart_mm"] = 1e3 * max(
        float(np.linalg.norm(a - b, axis=1).max()) for i, a in enumerate(places) for b in places[i + 1 :]
    )
    if case > 1:
        numbers["squared"] = _of_one(curves(paper_cell(f"vargas_case_{case}", method=OTHER_READING)))
    return numbers


def _of_one(run: Curves) -> Numbers:
    """What the paper says about one method."""
    settled = run.after(SETTLED)
    late = run.between >= SETTLED
    condition = run.report.conditioning.squared_condition[settled]
    return {
        "error_mm": 1e3 * run.error[settled].max(),
        "error_at_s": run.t[settled][np.argmax(run.error[settled])],
        "late_error_mm": 1e3 * run.error[run.after(PASSED_BY)].max(),
        "nearest_mm": 1e3 * nearest(run.actual[settled]),
        "kept_away_mm": 1e3 * (nearest(run.actual[settled]) - nearest(run.desired[settled])),
        "condition_min": condition.min(),
        "condition_max": condition.max(),
        "manipulability_min": run.report.conditioning.manipulability.min(),
        "speed_rad_s": np.abs(run.qd).max(),
        "late_speed_rad_s": np.abs(run.qd[late]).max(),
        "late_acceleration_rad_s2": np.abs(run.qdd[late[1:]]).max(),
        "turned_deg": np.rad2deg(turned(run.actual[settled])),
    }


def turned(places: Array) -> float:
    """Angle in [rad] by which the heading of a path in the plane turns, all turns added up."""
    along = np.diff(places[:, :2], axis=0)
    return float(np.abs(np.diff(np.unwrap(np.arctan2(along[:, 1], along[:, 0])))).sum())


def nearest(places: Array) -> float:
    """Smallest distance from the singular point (0, 0)."""
    return float(np.linalg.norm(places[:, :2], axis=1).min())


def _draw(case: int, result: dict[str, Curves]) -> None:
    """Paths, error norm, conditioning and joint speeds, as in figures 5 to 15."""
    sheet = Sheet(3, 2) if case > 1 else Sheet(2, 2)
    first = result["damped_least_squares"]
    named: dict[str, Curves] = {METHODS[method]: run for method, run in result.items()}
    numeral = "I" * case
    path_curve(
        sheet.panel(f"case {numeral}: paths", "x [m]", "y [m]"),
        first.desired[:, :2],
        {name: run.actual[:, :2] for name, run in named.items()},
    )
    if case in ZOOMS:
        axes = sheet.panel(f"case {numeral}: paths near the singular point", "x [m]", "y [m]")
        path_curve(axes, first.desired[:, :2], {name: run.actual[:, :2] for name, run in named.items()})
        axes.plot(0.0, 0.0, "k+", markersize=9)
        axes.set_aspect("auto")
        axes.set(xlim=ZOOMS[case][0], ylim=ZOOMS[case][1])
    error = sheet.panel(f"case {numeral}: norm of the error", "time [s]", "e [m]")
    draw(error, first.t, {name: run.error for name, run in named.items()})
    error.set_ylim(*ERRORS[case])
    condition: dict[str, Array] = {name: run.report.conditioning.squared_condition for name, run in named.items()}
    draw(sheet.panel(f"case {numeral}: conditioning c", "time [s]", "c"), first.t, condition)
    if case > 1:
        fastest = {name: np.asarray(np.abs(run.qd).max(axis=1)) for name, run in named.items()}
        draw(sheet.panel(f"case {numeral}: fastest joint", "time [s]", "speed [rad/s]"), first.between, fastest)
    axes = sheet.panel(f"case {numeral}: joint speeds, filtered inverse II", "time [s]", "speed [rad/s]")
    second = result["filtered_inverse_ii"]
    draw_joints(axes, second.between, second.qd, NAMES)
    sheet.save(f"vargas_case_{case}")
