"""Export jobs made by hand: random rows of arms, of an arm on a rail and of two robots that meet at marks."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from builders.scene_builders import arm_model, joint, make_cell, placed
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import ControllerEntry, HandshakeEntry, KindName, RobotControlEntry
from cellplan.programs.elements.dialect import Dialect

NAMES = ("alpha", "beta", "gamma", "delta")


def zero_of(count: int, *, coupling: float = 1.0) -> ControllerZero:
    """A controller that counts the last six axes from other zeros, two the other way round, axis 3 with axis 2."""
    first = count - 6
    zero, sign, factors = np.zeros(count), np.ones(count), np.zeros((count, count))
    zero[first:] = np.deg2rad([0.0, -90.0, 90.0, 0.0, 12.5, 0.0])
    sign[[first, first + 4]] = -1.0
    factors[first + 2, first + 1] = coupling
    return ControllerZero(zero=zero, sign=sign, coupling=factors, source="test")


def drawn_limits(model: RobotModel, rng: np.random.Generator) -> RobotModel:
    """The model with limits that no short decimal meets."""
    joints = tuple(
        replace(joint, lower=-float(rng.uniform(1.0, 2.9)), upper=float(rng.uniform(1.0, 2.9)))
        for joint in model.joints
    )
    return replace(model, joints=joints)


def rail_model() -> RobotModel:
    """The arm on a rail along x: the rail is its first joint."""
    arm = arm_model()
    rail = joint("rail", -1, axis=(1.0, 0.0, 0.0), slides=True)
    joints = (rail, *(replace(joint, parent=joint.parent + 1) for joint in arm.joints))
    bodies = tuple(replace(body, link=body.link + 1) for body in arm.bodies)
    return replace(arm, name="elbow on a rail", joints=joints, bodies=bodies, flange_link=6)


def positioner_model() -> RobotModel:
    """A table that two joints tilt and turn."""
    arm = arm_model()
    joints = (joint("tilt", -1, axis=(0.0, 1.0, 0.0)), joint("turn", 0, point=(0.0, 0.0, 0.4)))
    return replace(arm, name="table", joints=joints, bodies=(), flange_link=1)


def controlled(name: str, model: RobotModel, **control: object) -> Robot:
    """A robot with a controller of its own, named after it."""
    connected = RobotControlEntry(**{"id": "controller", **control})  # type: ignore[arg-type]
    if "id" not in control:  # a robot may have any name here, and its controller too
        connected = connected.model_copy(update={"id": f"{name}_controller"})
    return replace(placed(name, model), control=connected)


def signals(names: Sequence[str]) -> dict[str, HandshakeEntry]:
    """Handshake signals between all robots, whole numbers that differ."""
    return {
        name: HandshakeEntry.model_construct(
            output=10 + place,
            inputs={other: 100 + 10 * place + k for k, other in enumerate(names) if other != name},
        )
        for place, name in enumerate(names)
    }


def cell_of(*robots: Robot, kind: KindName) -> Cell:
    """A cell whose robots have controllers of one kind, and handshake signals where there are several robots."""
    if len(robots) > 1:
        handshakes = signals([robot.name for robot in robots])
        robots = tuple(
            robot
            if robot.control is None or robot.control.handshake is not None
            else replace(robot, control=robot.control.model_copy(update={"handshake": handshakes[robot.name]}))
            for robot in robots
        )
    names = dict.fromkeys(robot.control.id for robot in robots if robot.control is not None)
    controllers = {name: ControllerEntry(kind=kind) for name in names}
    return replace(make_cell(*robots), controllers=controllers)


def random_positions(robot: Robot, rows: int, rng: np.random.Generator, *, at_limit: bool = False) -> Array:
    """Positions within the limits, shape (N, n); on the limits or within a few millionths of them if asked for."""
    lower, upper = robot.model.lower, robot.model.upper
    q = rng.uniform(lower, upper, (rows, len(lower)))
    if at_limit:
        near = rng.uniform(0.0, 1e-6, q.shape) * rng.integers(0, 2, q.shape)
        q = np.where(rng.integers(0, 2, q.shape) == 1, upper - near, lower + near)
    return q


def random_program(
    cell: Cell,
    *,
    rows: int = 20,
    marks: Sequence[int] = (),
    name: str | None = None,
    seed: int = 0,
    at_limit: bool = False,
) -> ProgramRows:
    """A program of all robots of a cell: one clock, one set of marks, process in the second quarter of the rows."""
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 0.2, rows - 1))])
    process = np.zeros(rows, dtype=bool)
    process[rows // 4 : rows // 2] = True
    return ProgramRows(
        name=name,
        robots={
            robot.name: RobotRows(
                robot=robot.name,
                q=random_positions(robot, rows, rng, at_limit=at_limit),
                times=times,
                process=process,
                marks=tuple(marks),
            )
            for robot in cell.robots
        },
    )


def job_of(
    cell: Cell, *programs: ProgramRows, promise: Promise = Promise.SEQUENCE_ONLY, **changes: object
) -> ExportJob:
    """A job of programs for all robots of a cell; changes are of the job, ``split`` and ``robots`` of its frame."""
    options = {key: changes.pop(key) for key in ("split", "robots") if key in changes}
    frame = ExportFrame(
        cell=cell,
        robots=tuple(robot.name for robot in cell.robots),
        programs=tuple(program.name for program in programs),
        promise=promise,
    )
    job = ExportJob(frame=replace(frame, **options), programs=programs, notes=(f"promise: {promise}",))  # type: ignore[arg-type]
    return replace(job, **changes)  # type: ignore[arg-type]


def one_arm(kind: KindName, *, seed: int = 0, rows: int = 20, **changes: object) -> ExportJob:
    """A job of one six-axis arm with drawn limits and a controller that counts otherwise than the model."""
    model = replace(drawn_limits(arm_model(), np.random.default_rng(seed)), controller=zero_of(6))
    cell = cell_of(controlled(NAMES[0], model), kind=kind)
    return job_of(cell, random_program(cell, rows=rows, seed=seed), **changes)


def arm_on_a_rail(kind: KindName, *, seed: int = 0, rows: int = 20, **changes: object) -> ExportJob:
    """A job of one arm on a rail: one external axis in [mm]."""
    model = replace(drawn_limits(rail_model(), np.random.default_rng(seed)), controller=zero_of(7))
    cell = cell_of(controlled(NAMES[0], model), kind=kind)
    return job_of(cell, random_program(cell, rows=rows, seed=seed), **changes)


def two_arms(
    kind: KindName, *, seed: int = 0, rows: int = 20, marks: Sequence[int] = (0, 7, 19), **changes: object
) -> ExportJob:
    """A job of two arms that wait for one another at marks."""
    rng = np.random.default_rng(seed)
    cell = cell_of(*(controlled(name, drawn_limits(arm_model(), rng)) for name in NAMES[:2]), kind=kind)
    return job_of(cell, random_program(cell, rows=rows, seed=seed, marks=marks), **changes)


def read_back(dialect: Dialect, job: ExportJob) -> tuple[ProgramRows, ...]:
    """What the reader of a format finds in what its writer wrote."""
    return dialect.read(job.frame, dialect.render(job))


def written(folder: Path, files: dict[str, str]) -> None:
    """Files of an export on disk, byte for byte."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(text.encode())


def largest_deviation(job: ExportJob, read: tuple[ProgramRows, ...], robot: str) -> float:
    """Largest difference of a joint between a job and what was read, in [rad] or [m], over all programs."""
    pairs = zip(job.programs, read, strict=True)
    return max(float(np.abs(mine.robots[robot].q - other.robots[robot].q).max()) for mine, other in pairs)
