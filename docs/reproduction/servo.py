"""Nicolato 2007, section 4.4: the planar arm with masses and joint controllers that a camera leads to a point."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cellplan import load_errors
from cellplan.checks.real_cell import RealCell, pixels
from cellplan.jobs.rehearsal.correct import Pass, Plant, correct_within_the_pass
from cellplan.planning.modes import plan_phases
from cellplan.runs.plan.program import ProgramClock
from cellplan.scene.dynamics.simulated_cell import SimulatedCell
from cellplan.scene.kinematics.perturbed_cell import draw_errors, perturbed_cell
from reproduction.runs import PAPERS, Array, Numbers, paper_cell
from reproduction.sheet import GREY, Sheet, draw, draw_joints

ERRORS: Final = PAPERS.parent / "errors" / "nicolato_servo.yaml"
TARGET: Final = (240.0, 50.0)  # [px]
PRINTED_M: Final = 1.2  # height of the camera, Eq. 4.4
READ_M: Final = 1.1  # height that the search believes in, Eq. 4.6; there the target is within reach
REACH: Final = 0.6  # [m]
LONG_S, SHORT_S = 50.0, 10.0  # [s] as printed, and of the readings
DRAWN_S: Final = 6.0
SETTLED: Final = 0.05  # of the way in the image
READINGS: Final[Mapping[str, Mapping[str, Any]]] = {
    "share_0.02": {"share": 0.02},
    "share_0.1": {"share": 0.1},
    "encoder_link": {"encoder": "link"},
    "order_1_2_3": {"order": ("q1", "q2", "q3")},
    "dead_zone_first": {"saturation": 4.0},  # d(s(u)) with 4 is s(d(u)) with 3
    "no_backlash": {"backlash_deg": 0.0},
    "no_dead_zone": {"dead_zone": 0.0},
    "height_1.15": {"height": 1.15},
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Servo:
    """One run: times (N,), pixels (N, 2), joints of search and arm in [rad] (N, 3), and the target in pixels."""

    t: Array
    seen: Array
    commanded: Array
    executed: Array
    target: Array

    @property
    def error(self) -> Array:
        """Distance from the target in the image, shape (N,)."""
        return np.asarray(np.linalg.norm(self.seen - self.target, axis=1))


def measure() -> Numbers:
    """How far the printed target is, whole corrections, the reading of the table, and others."""
    chosen = run(seconds=LONG_S)
    if chosen is None:
        raise RuntimeError("the arm loses its path in the reading that the page shows")
    _draw(chosen)
    place = _place(PRINTED_M)
    return {
        "target": {
            "distance_m": float(np.linalg.norm(place)),
            "least_px": (float(np.linalg.norm(place)) - REACH) * 400.0 / PRINTED_M,
            "highest_m": PRINTED_M * REACH / float(np.linalg.norm(place)),
        },
        "whole": _figures(run(seconds=SHORT_S, share=1.0)),
        "chosen": _figures(chosen),
        "readings": {name: _figures(run(seconds=SHORT_S, **words)) for name, words in READINGS.items()},
    }


def run(
    *, seconds: float, height: float = READ_M, share: float | None = None, order: tuple[str, ...] = (), **arm: Any
) -> Servo | None:
    """The pass with the camera, as ``rehearse --in-pass`` makes it, with other settings; None where it is lost."""
    x, y = 1e3 * _place(height)
    values: dict[str, object] = {
        "tasks.target.duration_s": seconds,
        "tasks.target.path.polyline.points_mm": [[x - 0.1, y, 0], [x + 0.1, y, 0]],
    }
    if order:
        values["solver.search.sequence"] = [{"robot": "arm", "joint": joint} for joint in order]
    cell = paper_cell("nicolato_servo", values=values)
    stated = load_errors(ERRORS, cell)
    system, simulation = stated.measurement, stated.simulation
    if system.camera is None or simulation is None:
        raise RuntimeError(f"{ERRORS.name} has a camera and a simulated arm")
    camera = system.camera.changed(at=system.camera.at.changed(xyz_mm=(0.0, 0.0, 1e3 * height)))
    system = system.changed(camera=camera, share=system.share if share is None else share)
    robots = {"arm": simulation.robots["arm"].changed(**arm)}
    real = perturbed_cell(cell, draw_errors(cell, stated, 0))
    arms = SimulatedCell(real, simulation.changed(robots=robots), file=ERRORS.name)
    plant = Plant(real=RealCell(real), arms=arms, system=system, rng=np.random.default_rng(0))
    (schedule,) = ProgramClock.from_cell(cell, plan_phases(cell)).schedules
    start = cell.robots[0].start
    if start is None:
        raise RuntimeError("the arm starts at zero")
    job = Pass(cell=cell, schedule=schedule, moving=("arm",), judged_from={}, q=start[None])
    result = correct_within_the_pass(job, plant)
    if result is None:
        return None
    (accuracy,), joints = result
    place = np.array([1e-3 * x, 1e-3 * y, 0.0])
    return Servo(
        t=schedule.times,
        seen=pixels(camera, place - accuracy.position_error),
        commanded=joints.commanded,
        executed=joints.executed,
        target=pixels(camera, place[None])[0],
    )


def _place(height: float) -> Array:
    """Place on the table in [m] that a camera of Eqs. 4.3 and 4.4 at a height in [m] sees at the target."""
    u, v = (np.array(TARGET) - [320.0, 240.0]) * height / 400.0
    return np.array([-v, -u])


def _figures(servo: Servo | None) -> Numbers:
    """What is claimed of a run; -1 for what does not come to pass."""
    if servo is None:
        return {"lost": True}
    error, t = servo.error, servo.t
    late = np.flatnonzero(error > SETTLED * error[0])
    rest = t >= t[-1] - 1.0
    beyond = np.maximum(0.0, np.sign(servo.target - servo.seen[0]) * (servo.seen - servo.target)).max()
    return {
        "lost": False,
        "error_px": error[-1],
        "error_after_10_s_px": error[np.searchsorted(t, SHORT_S - 1e-9)],
        "swing_px": np.ptp(servo.seen[rest], axis=0).max(),
        "settled_s": t[late[-1] + 1] if late[-1] + 1 < len(t) else -1.0,
        "beyond_px": beyond,
        "speed_rad_s": np.abs(np.diff(servo.executed, axis=0) / np.diff(t)[:, None]).max(),
        "joint_errors_rad": (servo.commanded - servo.executed)[-1],
        "joints_rad": servo.executed[-1],
    }


def _draw(servo: Servo) -> None:
    """Figures 4.10 and 4.11."""
    early = servo.t <= DRAWN_S
    t, seen = servo.t[early], servo.seen[early]
    sheet = Sheet(2, 3)
    axes = sheet.panel("path in the image", "u [px]", "v [px]")
    axes.plot(*seen.T, color="#2f6fab")
    axes.plot(*servo.target, "o", color="#c03a4b", markersize=4)
    axes.invert_yaxis()
    for index, name in enumerate("uv"):
        axes = sheet.panel(f"{name} in the image", "time [s]", "[px]")
        draw(axes, t, {"": seen[:, index]})
        axes.axhline(servo.target[index], color="#c03a4b", linewidth=0.9)
    draw(
        sheet.panel("error in the image", "time [s]", "[px]"), t, dict(zip("uv", (seen - servo.target).T, strict=True))
    )
    draw(sheet.panel("norm of the error, 50 s", "time [s]", "[px]"), servo.t, {"": servo.error})
    axes = sheet.panel("joints of the search, and of the arm (grey)", "time [s]", "[rad]")
    axes.plot(t, servo.executed[early], ":", color=GREY)
    draw_joints(axes, t, servo.commanded[early], [rf"$\theta_{i}$" for i in (1, 2, 3)])
    sheet.save("nicolato_servo")
