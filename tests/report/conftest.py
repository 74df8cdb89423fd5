"""Reports built by hand: four robots, three tasks, one variant that fails, one with a rail, and a hostile one."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from cellplan.geometry.shapes import Cylinder
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Grasp, Mode, MotionSettings, Part, Robot, Tool
from cellplan.model.origin import Origin
from cellplan.model.report.report import (
    Check,
    ClearanceClass,
    ClearanceMinimum,
    ClearanceReport,
    ClosePair,
    Conditioning,
    Contact,
    JointUse,
    Report,
    RobotSpeed,
    TaskAccuracy,
)
from cellplan.model.robot.robot import Joint, JointKind, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import CirclePath, PlaneName, Task, TimeLaw, TimeLawKind
from cellplan.report.record.common import Provenance

N = 4001
TIMES = 0.001 * np.arange(N)
LIMITS = {
    "reis": (("D1", 180, 140), ("D2", 110, 140), ("D3", 135, 140), ("D4", 180, 200), ("D5", 95, 200), ("D6", 270, 250)),
    "kuka": (
        ("B1", 185, 156),
        ("B2", 100, 156),
        ("B3", 130, 156),
        ("B4", 350, 343),
        ("B5", 118, 362),
        ("B6", 350, 659),
    ),
    "abb": (("A1", 180, 150), ("A2", 110, 160), ("A3", 120, 170), ("A4", 200, 320), ("A5", 115, 400), ("A6", 400, 460)),
    "staubli": (
        ("C1", 160, 356),
        ("C2", 137, 356),
        ("C3", 142, 296),
        ("C4", 270, 409),
        ("C5", 120, 480),
        ("C6", 270, 1125),
    ),
}
TASKS = {"circle": "kuka", "rhombus": "abb", "rectangle": "staubli"}


@dataclass(frozen=True)
class Run:
    """What the report functions take."""

    report: Report
    cell: Cell
    provenance: Provenance


def _robot(name: str, kinds: str) -> Robot:
    joints = tuple(
        Joint(
            name=joint,
            kind=JointKind.PRISMATIC if kind == "p" else JointKind.REVOLUTE,
            parent=index - 1,
            axis_B=np.array([0.0, 0.0, 1.0]),
            point_B=np.zeros(3),
            lower=-math.radians(limit),
            upper=math.radians(limit),
            velocity=math.radians(speed),
        )
        for index, ((joint, limit, speed), kind) in enumerate(zip(LIMITS[name], kinds, strict=True))
    )
    model = RobotModel(name=f"{name}_model", source="", joints=joints, flange_link=5, X_BF=np.eye(4), bodies=())
    tool = Tool(X_FT=np.eye(4), bodies=())
    return Robot(name=name, model=model, X_WB=np.eye(4), tool=tool, start=None, weights=np.ones(6))


def _task(name: str, robot: str) -> Task:
    return Task(
        name=name,
        robot=robot,
        path=CirclePath(plane=PlaneName.XY, center=(0.0, 0.0), radius=0.1),
        project=np.array([0.0, 0.0, 1.0]),
        plane_offset=0.0,
        tool_axis=None,
        tool_x=np.array([1.0, 0.0, 0.0]),
        turn=0.0,
        axes=(0, 1, 2, 3, 4, 5),
        is_spin_free=False,
        tolerance=ToleranceEntry(position_mm=0.1, orientation_deg=0.01),
        start=0.0,
        duration=None,
        feed=None,
        time_law=TimeLaw(kind=TimeLawKind.QUINTIC),
        blend=None,
    )


def _cell(name: str, kinds: str = "rrrrrr") -> Cell:
    return Cell(
        name=name,
        robots=tuple(_robot(robot, kinds if robot == "reis" else "rrrrrr") for robot in LIMITS),
        part=Part(shape=Cylinder(0.25, 0.5), X_PS=np.eye(4), held_by=(Grasp(robot="reis", X_PT=np.eye(4)),), X_WP=None),
        tasks=tuple(_task(task, robot) for task, robot in TASKS.items()),
        obstacles=(),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=4.0, step=0.001),
        solver=SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=650.0, seed=7),
        checks=ChecksEntry(),
        origin=Origin(file="cell.yaml"),
        inputs={"cell.yaml": "7c" * 32, "robots/kuka_kr6.yaml": "1f" * 32},
    )


def _positions(robot: int, amplitude: float) -> Array:
    joint = np.arange(6)
    s = TIMES / TIMES[-1]
    smooth = s**3 * (10 - 15 * s + 6 * s**2)
    centre = np.deg2rad(18.0 * np.cos(3.0 * joint + robot))
    phase = 2 * np.pi * np.outer(smooth, np.ones(6)) + joint + robot
    return centre + amplitude * np.deg2rad(4.0 + 3.0 * joint) * (np.sin(phase) - np.sin(joint + robot))


def _use(robot: str, joint: Joint, q: Array, qd: Array) -> JointUse:
    margins = np.minimum(q - joint.lower, joint.upper - q)
    return JointUse(
        robot=robot,
        joint=joint.name,
        is_revolute=joint.is_revolute,
        min=float(q.min()),
        max=float(q.max()),
        lower=joint.lower,
        upper=joint.upper,
        margin=float(margins.min()),
        margin_at_s=float(TIMES[margins.argmin()]),
        peak_velocity=float(np.abs(qd).max()),
        velocity_limit=joint.velocity,
        peak_velocity_at_s=float(TIMES[np.abs(qd).argmax()]),
        travel=float(np.abs(np.diff(q)).sum()),
    )


def _accuracy(index: int, task: str, robot: str) -> TaskAccuracy:
    envelope = np.sin(np.pi * TIMES / 4.0)[:, None] ** 2
    wave = np.sin(2 * np.pi * TIMES[:, None] * np.array([1.0, 0.5, 1.5]) + np.arange(3) + index)
    return TaskAccuracy(
        task=task,
        robot=robot,
        position_error=1.4e-6 * envelope * wave,
        orientation_error=6e-6 * envelope * wave[:, ::-1],
        path_length=0.63 + 0.1 * index,
        start_s=0.0,
        end_s=4.0,
    )


def _speed(i: int) -> RobotSpeed:
    return RobotSpeed(
        tool_peak=0.2 + 0.1 * i,
        tool_peak_at_s=1.25,
        share_above_reduced=0.25 * i,
        axis_peak=0.3,
        axis="C3",
        axis_peak_at_s=2.5,
    )


def _clearance() -> ClearanceReport:
    curve_times = TIMES[::10]
    names = {
        ClearanceClass.ROBOT_ROBOT: ("kuka/B4", "abb/tool", 0.213, 1.72),
        ClearanceClass.SELF: ("staubli/C3", "staubli/C6", 0.041, 3.06),
        ClearanceClass.PART: ("abb/A6", "part", 0.067, 2.2),
        ClearanceClass.ENVIRONMENT: ("reis/D6", "floor", 0.48, 2.0),
    }
    minima = {
        kind: ClearanceMinimum(
            minimum=value,
            pair=(first, second),
            at_s=at,
            certified=True,
            points=((1.2, 0.0, 0.9), (1.2 + value, 0.0, 0.9)),
        )
        for kind, (first, second, value, at) in names.items()
    }
    curves = {kind: value + 0.06 * (1 - np.cos(1.3 * (curve_times - at))) for kind, (_, _, value, at) in names.items()}
    contacts = tuple(
        Contact(
            pair=(f"{robot}/tool", "part"),
            clearance_class=ClearanceClass.PART,
            first_s=0.0,
            last_s=4.0,
            is_allowed=True,
            reason="tool tip within 20 mm of the process point",
        )
        for robot in TASKS.values()
    )
    neighbours = tuple(
        (f"{robot}/{a}", f"{robot}/{b}", "neighbour links")
        for robot, joints in LIMITS.items()
        for (a, *_), (b, *_) in pairwise(joints)
    )
    user = (("abb/base", "staubli/base", "on one pedestal by design"),)
    return ClearanceReport(
        minima=minima,
        contacts=contacts,
        exclusions=neighbours + user,
        pair_count=612,
        curve_times=curve_times,
        curves=curves,
        closest=tuple(
            ClosePair(pair=(first, second), clearance_class=kind, distance=value, at_s=at)
            for kind, (first, second, value, at) in sorted(names.items(), key=lambda item: item[1][2])
        ),
        distance_queries=349,
        contact_queries=348,
        cut_steps=2,
    )


def _checks(uses: tuple[JointUse, ...], accuracy: tuple[TaskAccuracy, ...]) -> tuple[Check, ...]:
    checks = []
    for use in uses:
        beyond = -use.margin
        joint = f"{use.robot} {use.joint}"
        value, limit = (use.max, use.upper) if use.upper - use.max < use.min - use.lower else (use.min, use.lower)
        checks.append(
            Check(
                name="joint_position",
                subject=joint,
                passed=beyond <= 0.0,
                value=math.degrees(value),
                limit=math.degrees(limit),
                unit="deg",
                at_s=use.margin_at_s,
                message=f"{joint} leaves its range by {math.degrees(beyond):.1f} deg at {use.margin_at_s:.3f} s "
                f"({math.degrees(value):.1f} deg, limit {math.degrees(limit):g} deg)"
                if beyond > 0.0
                else f"{joint} stays {math.degrees(use.margin):.1f} deg inside its range",
            )
        )
    checks += [
        Check(
            name="position_error",
            subject=entry.task,
            passed=True,
            value=0.0021,
            limit=0.1,
            unit="mm",
            at_s=2.0,
            message=f"{entry.task}: tool error at most 0.0021 mm",
        )
        for entry in accuracy
    ]
    return tuple(checks)


def _run(name: str = "four-robots", amplitude: float = 1.0, kinds: str = "rrrrrr") -> Run:
    cell = _cell(name, kinds)
    q = {robot.name: _positions(index, amplitude) for index, robot in enumerate(cell.robots)}
    qd = {robot: np.diff(series, axis=0) / 0.001 for robot, series in q.items()}
    uses = tuple(
        _use(robot.name, joint, q[robot.name][:, i], qd[robot.name][:, i])
        for robot in cell.robots
        for i, joint in enumerate(robot.model.joints)
    )
    accuracy = tuple(_accuracy(i, task, robot) for i, (task, robot) in enumerate(TASKS.items()))
    share = {"reis": (0.46, "D4"), "kuka": (0.17, "B6"), "abb": (0.15, "A4"), "staubli": (0.22, "C4")}
    conditioning = Conditioning(
        stack=0.2 + 0.05 * np.cos(TIMES),
        condition=0.1 + 0.02 * np.cos(TIMES),
        manipulability=3e-7 + 1e-7 * np.sin(TIMES),
        robots={robot: 0.3 + 0.1 * np.sin(TIMES + i) for i, robot in enumerate(q)},
    )
    report = Report(
        cell=name,
        mode="simultaneous",
        tasks=tuple(TASKS),
        checks=_checks(uses, accuracy),
        accuracy=accuracy,
        joints=uses,
        clearance=_clearance(),
        conditioning=conditioning,
        motion_share=share,
        speeds={robot: _speed(i) for i, robot in enumerate(q)},
        times=TIMES,
        q=q,
        qd=qd,
    )
    provenance = Provenance(
        versions={"cellplan": "0.1.0", "numpy": "2.4.0", "pin": "4.1.0"}, digests={"program": "a5" * 32}
    )
    return Run(report=report, cell=cell, provenance=provenance)


@pytest.fixture(scope="session")
def passed_run() -> Run:
    """Everything within limits."""
    return _run()


@pytest.fixture(scope="session")
def failed_run() -> Run:
    """Some joints leave their range."""
    run = _run("four-robots-initial", amplitude=3.4)
    clearance = run.report.clearance
    hit = Contact(
        pair=("kuka/B5", "abb/A5"),
        clearance_class=ClearanceClass.ROBOT_ROBOT,
        first_s=1.204,
        last_s=1.377,
        is_allowed=False,
        reason="collision",
    )
    touching = ClearanceMinimum(minimum=0.0, pair=hit.pair, at_s=1.204, certified=True)
    check = Check(
        name="clearance",
        subject="kuka/B5 and abb/A5",
        passed=False,
        value=0.0,
        limit=5.0,
        unit="mm",
        at_s=1.204,
        message="kuka/B5 and abb/A5 collide from 1.204 s to 1.377 s",
    )
    clearance = replace(
        clearance,
        contacts=(hit, *clearance.contacts),
        minima={**clearance.minima, ClearanceClass.ROBOT_ROBOT: touching},
    )
    return replace(run, report=replace(run.report, clearance=clearance, checks=(*run.report.checks, check)))


@pytest.fixture(scope="session")
def rail_run() -> Run:
    """The positioner stands on a rail and its last joint turns without end; one class has no pair."""
    run = _run(kinds="prrrrr")
    joints = list(run.report.joints)
    joints[5] = replace(joints[5], lower=-math.inf, upper=math.inf, margin=math.inf)
    minima = dict(run.report.clearance.minima)
    minima[ClearanceClass.ENVIRONMENT] = ClearanceMinimum(minimum=None, pair=None, at_s=None, certified=False)
    clearance = replace(run.report.clearance, minima=minima)
    return replace(run, report=replace(run.report, joints=tuple(joints), clearance=clearance))


@pytest.fixture(scope="session")
def pairwise_runs(passed_run: Run, failed_run: Run) -> dict[str, Run]:
    """One run per task; the second fails."""

    def only(run: Run, task: str) -> Run:
        accuracy = tuple(entry for entry in run.report.accuracy if entry.task == task)
        report = replace(run.report, cell="four-robots", mode="pairwise", tasks=(task,), accuracy=accuracy)
        return replace(run, cell=passed_run.cell, report=report)

    return {task: only(failed_run if task == "rhombus" else passed_run, task) for task in TASKS}


@pytest.fixture
def make_run() -> Callable[..., Run]:
    """Runs with other names and amplitudes."""
    return _run
