"""Transfer moves of real arms among random obstacles: ``python benchmarks/transfers.py --cells 20``.

A free cell is built round a known way of its arm: obstacles are kept off the bodies that it sweeps, but stand near the
straight move, so that this is seldom free. A walled-in cell has a block in the way of a point of the arm's first link,
which passes there whatever the other joints do: there is no way by construction.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import coal
import numpy as np
from coal_shapes import coal_shape

from cellplan.errors import TransferNotFoundError
from cellplan.files.robots.joint_table import load_bundled
from cellplan.files.robots.urdf.load import load_urdf
from cellplan.geometry.shapes import Box, Cylinder, HalfSpace, Solid, Sphere, bounding_sphere
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell, Mode, MotionSettings, Obstacle, Part, Robot, Tool
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import Body, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.transfer.plan import PlannedTransfer, plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.runs.plan.retiming import RowLimits, joint_bounds
from cellplan.scene.scene import Scene

BUNDLED: Final = ("kuka_kr6", "abb_irb1600_8_145", "staubli_rx160", "ur5e", "ur10e", "kuka_kr16_2", "staubli_rx90l")
OUTSIDE: Final = ("kuka_kr16_2", "kuka_kr5_arc", "abb_irb1600_8_145", "staubli_rx160")  # below ../shared/robots
CLEARANCE: Final = 0.005  # [m]
CLEAR_OF_PATH: Final = 0.03  # [m] that obstacles keep from what is swept on the known way
BLOCK_OFF: Final = 0.01  # [m] that the block keeps from the arm at start and goal
BLOCKS_TRIED: Final = 400  # places of the block for one pair of start and goal
THINGS: Final = 10  # obstacles of a cell
ROW_STEP: Final = 0.004  # [s]
FINE: Final = 0.004  # [rad] largest move of a joint between two samples of brute force
COARSE: Final = 0.02  # [rad] likewise where a cell is made: no body comes farther than twice KEPT_OFF


@dataclass(frozen=True, eq=False)
class Case:
    """A cell with a transfer that is asked for.

    Attributes:
        scene: The scene.
        start: Joint positions in [rad], shape (n,).
        goal: Likewise.
    """

    scene: Scene
    start: Array
    goal: Array


def outside_models() -> list[RobotModel]:
    """Arms whose descriptions are not part of the project; none where they are not on this machine."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "robots"
    return [load_urdf(folder / name / f"{name}.urdf").model for name in OUTSIDE if (folder / name).is_dir()]


def models() -> list[RobotModel]:
    """All arms that the cells are made with."""
    return [*(load_bundled(name) for name in BUNDLED), *outside_models()]


def scene_with(model: RobotModel, things: Sequence[Obstacle]) -> Scene:
    """An arm with a slender tool on a floor."""
    shaft = Body(name="tool", link=0, shape=Cylinder(0.02, 0.25), X_BS=pose((0.0, 0.0, 0.125)))
    robot = Robot(
        name="arm",
        model=model,
        X_WB=np.eye(4),
        tool=Tool(X_FT=pose((0.0, 0.0, 0.25)), bodies=(shaft,)),
        start=None,
        weights=np.ones(len(model.joints)),
    )
    floor = Obstacle(name="floor", shape=HalfSpace(), X_WS=pose((0.0, 0.0, -0.01)))
    cell = Cell(
        name="transfer",
        robots=(robot,),
        part=Part(shape=Sphere(0.01), X_PS=np.eye(4), held_by=(), X_WP=pose((0.0, 0.0, 50.0))),
        tasks=(),
        obstacles=(floor, *things),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=1.0, step=ROW_STEP),
        solver=SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=500.0),
        checks=ChecksEntry(clearance_mm=1e3 * CLEARANCE),
        origin=Origin(),
        inputs={},
    )
    return Scene.from_cell(cell)


def retimer_of(scene: Scene) -> Retimer:
    """The limits of all joints, as the planner has them."""
    limits = RowLimits(scene, (), joint_bounds(scene.cell), scene.cell.motion.step)
    return Retimer(
        bounds=limits.bounds, step=limits.step, feed_share=lambda sigma: np.zeros(len(sigma)), slower=limits.slower
    )


class BruteForce:
    """Contacts by another engine than that of the program, at many samples."""

    def __init__(self, scene: Scene) -> None:
        """Build coal's bodies."""
        self._scene = scene
        self._shapes = [coal_shape(body.shape) for body in scene.engine.bodies]

    def contact(self, q: Array) -> tuple[str, str] | None:
        """Names of the first pair of solids that touch at any of some samples, shape (K, n)."""
        poses = self._scene.body_poses(q)
        centres = np.array([poses.R[k] @ c + poses.p[k] for k, c in enumerate(self._scene.engine.centres)])
        for pair in self._scene.pairs:
            if pair.solids is None:
                if self._scene.ground_heights(pair, poses).min() <= 0.0:
                    return self._scene.names(pair)
                continue
            a, b = pair.solids
            gaps = np.linalg.norm(centres[a] - centres[b], axis=1) - self._scene.engine.radii[[a, b]].sum()
            for sample in np.flatnonzero(gaps <= 0.0).tolist():
                if self.touch(a, b, poses.R[:, sample], poses.p[:, sample]):
                    return self._scene.names(pair)
        return None

    def touch(self, a: int, b: int, R: Array, p: Array) -> bool:
        """Whether two bodies touch."""
        places = [coal.Transform3s(R[k], p[k]) for k in (a, b)]
        result = coal.CollisionResult()
        coal.collide(self._shapes[a], places[0], self._shapes[b], places[1], coal.CollisionRequest(), result)
        return bool(result.isCollision())


def finer(q: Array, move: float = FINE) -> Array:
    """Samples between rows, joints straight from row to row, shape (K, n)."""
    counts = np.maximum(1, np.ceil(np.abs(np.diff(q, axis=0)).max(axis=1) / move).astype(int))
    pieces = [a + np.arange(n)[:, None] / n * (b - a) for a, b, n in zip(q[:-1], q[1:], counts, strict=True)]
    return np.concatenate([*pieces, q[-1:]])


def free_case(model: RobotModel, rng: np.random.Generator) -> Case:
    """A cell round a known way."""
    bare = scene_with(model, ())
    path = _known_path(bare, rng)
    poses = bare.body_poses(finer(path, COARSE))
    engine = bare.engine
    shapes = [coal_shape(body.shape) for body in engine.bodies]
    centres = np.array([poses.R[k] @ centre + poses.p[k] for k, centre in enumerate(engine.centres)])
    straight = path[0] + np.linspace(0.2, 0.8, 7)[:, None] * (path[-1] - path[0])
    tips = bare.chains["arm"].tool_poses(straight)[:, :3, 3]
    things: list[Obstacle] = []
    while len(things) < THINGS:
        shape = _random_shape(rng)
        at = tips[rng.integers(len(tips))] * rng.uniform(0.6, 1.0) + rng.normal(scale=0.1, size=3)
        thing = Obstacle(name=f"thing{len(things)}", shape=shape, X_WS=pose_from(rotation_exp(rng.normal(size=3)), at))
        gaps = np.linalg.norm(centres - at, axis=2) - engine.radii[:, None] - bounding_sphere(shape)[1]
        near = np.argwhere(gaps < CLEAR_OF_PATH).tolist()
        if all(_distance(shapes[k], poses.R[k, i], poses.p[k, i], thing) >= CLEAR_OF_PATH for k, i in near):
            things.append(thing)
    return Case(scene_with(model, things), path[0], path[-1])


def walled_case(model: RobotModel, rng: np.random.Generator) -> Case:
    """A cell with a block that the first link touches where all ways pass, whatever the other joints do."""
    bare = scene_with(model, ())
    engine = bare.engine
    shapes = [coal_shape(body.shape) for body in engine.bodies]
    at_zero = bare.body_poses(np.zeros((1, len(model.joints))))
    out = np.linalg.norm([at_zero.R[k, 0, :2] @ c + at_zero.p[k, 0, :2] for k, c in enumerate(engine.centres)], axis=1)
    link = max((k for k in range(len(shapes)) if bare.carrier(k).link == 0), key=lambda k: float(out[k]))
    while True:
        path = _known_path(bare, rng, turn=2.0)
        q = np.array([path[0], path[-1], path[0]])
        q[2, 0] = 0.5 * (path[0, 0] + path[-1, 0])
        poses = bare.body_poses(q)
        centre = poses.R[link, 2] @ engine.centres[link] + poses.p[link, 2]
        for _ in range(BLOCKS_TRIED):
            at = centre + rng.normal(scale=0.7 * engine.radii[link], size=3)
            block = Obstacle(name="block", shape=Box((0.03, 0.03, 0.03)), X_WS=pose(tuple(at)))
            touched = _distance(shapes[link], poses.R[link, 2], poses.p[link, 2], block) <= 0.0
            ends = ((k, i) for i in range(2) for k in range(len(shapes)))
            if touched and all(_distance(shapes[k], poses.R[k, i], poses.p[k, i], block) > BLOCK_OFF for k, i in ends):
                scene = scene_with(model, [block])
                if scene.touching(path[0]) is None and scene.touching(path[-1]) is None:  # nor is it inside a link
                    return Case(scene, path[0], path[-1])


def _known_path(bare: Scene, rng: np.random.Generator, *, turn: float = 1.0) -> Array:
    """Three via points, straight between them without contact, the first joint turning by an angle at least."""
    model = bare.cell.robots[0].model
    lower, upper = np.maximum(model.lower, -2.5), np.minimum(model.upper, 2.5)
    force = BruteForce(bare)
    while True:
        path = rng.uniform(lower, upper, (3, len(lower)))
        if (
            abs(path[2, 0] - path[0, 0]) > turn
            and force.contact(finer(path, 0.3)) is None
            and (force.contact(finer(path, COARSE)) is None)
        ):
            return path


def _random_shape(rng: np.random.Generator) -> Solid:
    sizes = rng.uniform(0.05, 0.25, 3)
    shapes = (Box((sizes[0], sizes[1], sizes[2])), Cylinder(0.4 * sizes[0], 4.0 * sizes[1]), Sphere(0.6 * sizes[0]))
    return shapes[int(rng.integers(3))]


def _distance(shape: coal.CollisionGeometry, R: Array, p: Array, thing: Obstacle) -> float:
    """Distance of a body and an obstacle in [m]."""
    place = coal.Transform3s(thing.X_WS[:3, :3], thing.X_WS[:3, 3])
    return coal.distance(
        shape, coal.Transform3s(R, p), coal_shape(thing.shape), place, coal.DistanceRequest(), coal.DistanceResult()
    )


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What came of a case.

    Attributes:
        model: Name of the arm.
        seconds: Processor time in [s].
        move: The transfer; None where it was refused.
        reason: Why it was refused.
        contact: Two bodies that touch by brute force.
    """

    model: str
    seconds: float
    move: PlannedTransfer | None
    reason: str = ""
    contact: tuple[str, str] | None = None


def outcome(case: Case, *, seed: int = 0) -> Outcome:
    """Plan a case and judge what is found by brute force."""
    begin, name = time.process_time(), case.scene.cell.robots[0].model.name
    try:
        move = plan_transfer(
            TransferQuery.of(case.scene, case.start, case.goal, seed=seed), retimer=retimer_of(case.scene)
        )
    except TransferNotFoundError as reason:
        return Outcome(model=name, seconds=time.process_time() - begin, move=None, reason=str(reason))
    seconds = time.process_time() - begin
    return Outcome(model=name, seconds=seconds, move=move, contact=BruteForce(case.scene).contact(finer(move.q)))


def cases(count: int, *, is_walled: bool) -> Iterator[Case]:
    """Cells of all arms in turn."""
    arms = models()
    for number in range(count):
        rng = np.random.default_rng([number, is_walled])
        yield (walled_case if is_walled else free_case)(arms[number % len(arms)], rng)


def main() -> None:
    """Print one line for each cell, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=20, help="cells of either kind")
    parser.add_argument("--kind", choices=("free", "walled"), help="only these")
    options = parser.parse_args()
    count = options.cells
    for is_walled in [kind == "walled" for kind in ("free", "walled") if options.kind in {None, kind}]:
        result = contacts = 0
        seconds = []
        for number, case in enumerate(cases(count, is_walled=is_walled)):
            one = outcome(case)
            result, contacts = result + (one.move is not None), contacts + (one.contact is not None)
            seconds.append(one.seconds)
            said = one.reason if one.move is None else f"{one.move.times[-1]:.3f} s {set(one.move.rungs.values())}"
            print(f"{number:3d} {one.model:22s} {one.seconds:6.2f} s CPU  {said} {one.contact or ''}", flush=True)
        print(
            f"{'walled in' if is_walled else 'free'}: {result} of {count} found, {contacts} touch by brute force, "
            f"CPU median {np.median(seconds):.2f} s, most {max(seconds):.2f} s"
        )


if __name__ == "__main__":
    main()
