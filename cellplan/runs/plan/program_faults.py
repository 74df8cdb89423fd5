"""Faults of a program from home to home that are known before its moves are planned, each at its place in the cell."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows, scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.errors import HomeNotFoundError, InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.program import PartPlaceEntry
from cellplan.model.units import MM
from cellplan.planning.sequence.part_moves import PartMove
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import HOME, Stage
from cellplan.planning.start.given import home_key, home_place
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.planning.transfer.reasons import nearest_words
from cellplan.scene.bodies import Kind, is_ground
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.separation import heights
from cellplan.scene.mounting import Mount
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

GAP_TOL: Final = 1e-4  # [m] distances are worked out to that


def _key(stage: Stage) -> str:
    """Key of the place at which a straight move grips or puts down the part."""
    return "program.attach" if stage.move in (PartMove.GRIP, PartMove.LIFT) else "program.detach"


def refuse_sunk_parts(scenes: StageScenes) -> None:
    """Refuse places at which the part lies deep in a body of the environment.

    Raises:
        InputError: With the body and the depth.
    """
    cell = scenes.cell
    for key, _, scene in _places(scenes):
        parts = {body.name for body in scene.bodies if body.kind is Kind.PART}
        standing = [pair for pair in scene.mounted if pair.mount is Mount.STANDING]
        for check in check_mounting(replace(scene, mounted=tuple(standing)), np.zeros((1, cell.joint_count))):
            if not check.passed and parts & {*check.subject.split(" - ")}:
                raise InputError(f"{cell.origin.at(f'program.{key}.at')}: {check.message}")


def refuse_hanging_parts(scenes: StageScenes) -> None:
    """Refuse places at which the part would fall: it touches nothing that it rests on, and is not clamped.

    Raises:
        InputError: With the body and the distance.
    """
    for key, place, scene in _places(scenes):
        gaps = {} if place.clamped else _gaps(scene)
        where = scenes.cell.origin.at(f"program.{key}.rests_on")
        cure = "move the place or the body, or state clamped: true for a nest, magnet or hook that holds it"
        for name in place.supports if gaps else ():
            if gaps[name] > place.rest_gap_mm.si + GAP_TOL:
                raise InputError(
                    f"{where}: expected a part that touches '{name}' where it lies, within rest_gap_mm = "
                    f"{place.rest_gap_mm:g}, got one {MM * gaps[name]:.4g} mm away, which would fall: {cure}"
                )
        if not place.clamped and not place.supports and min(gaps.values(), default=np.inf) > place.rest_gap_mm.si:
            nearest = min(gaps, key=lambda name: gaps[name], default="")
            got = f"'{nearest}', the nearest, {MM * gaps[nearest]:.4g} mm away" if nearest else "no surroundings"
            raise InputError(
                f"{where}: expected a body that the part rests on, got none ({got}), so that it would fall: "
                f"name one, {cure}"
            )


def _places(scenes: StageScenes) -> Iterator[tuple[str, PartPlaceEntry, Scene]]:
    """Places at which the part lies, with their keys and the scene there."""
    program = scenes.cell.program
    for key, place in (("attach", program.attach), ("detach", program.detach)):
        if place is not None:
            yield key, place, scenes.with_part_at(place)


def _gaps(scene: Scene) -> dict[str, float]:
    """Distance in [m] of a part at rest from each body of the environment; zero where they touch."""
    part = next(index for index, body in enumerate(scene.bodies) if body.kind is Kind.PART)
    poses, gaps = scene.body_poses(np.zeros((1, scene.cell.joint_count))), {}
    for index, body in enumerate(scene.bodies):
        if body.kind is Kind.OBSTACLE and is_ground(body):
            above = heights(scene.engine.bodies[part].hull, poses.R[part], poses.p[part], X_WS=body.X_BS)
            gaps[body.name] = max(0.0, float(above[0]))
        elif body.kind is Kind.OBSTACLE:
            gaps[body.name] = measure(scene.engine, (part, index), poses, sample=0).bound
    return gaps


def refuse_unnamed_supports(scenes: StageScenes) -> None:
    """Refuse places at which the part is nearer to a body of the environment than allowed, and does not rest on it.

    Raises:
        InputError: With the body and the distance.
    """
    demands = dict[str, float]()  # least distance of the held part in [m] by body; 0 where only contact is forbidden
    for pair in scenes.held.pairs:
        bodies = {body.kind: body for body in (scenes.held.bodies[pair.first], scenes.held.bodies[pair.second])}
        if bodies.keys() == {Kind.PART, Kind.OBSTACLE}:
            demands[bodies[Kind.OBSTACLE].name] = pair.demand if pair.rule is Rule.CLEARANCE else 0.0
    for key, place, scene in _places(scenes):
        for name, gap in _gaps(scene).items():
            if name in place.supports or name not in demands or gap > max(demands[name] - GAP_TOL, 0.0):
                continue
            held = f"is {MM * gap:.4g} mm from" if gap > 0.0 else "touches"
            raise InputError(
                f"{scenes.cell.origin.at(f'program.{key}.rests_on')}: 'part' {held} '{name}', "
                f"{MM * demands[name]:g} mm are demanded where the part lies: name the body that it rests on, or move "
                f"the place"
            )


def refuse_crowded_homes(scene: Scene, home: Array) -> None:
    """Refuse homes at which robots keep less distance than is demanded.

    Args:
        scene: The scene of the first or the last transfer move.
        home: Stacked homes of all robots in [rad] or [m], shape (nq,).

    Raises:
        HomeNotFoundError: With the bodies and their distance.
    """
    at_rest, cell, alone = home[None].repeat(2, axis=0), scene.cell, scene_of_run(scene, ())
    if certify(alone, at_rest, with_minimum=False).is_met:
        return
    words, bodies = nearest_words(alone, at_rest)
    robot = next(
        (robot for name in bodies for robot in cell.robots if name.startswith(f"{robot.name}/")), cell.robots[0]
    )
    raise HomeNotFoundError(
        f"{home_place(cell, robot)}: the homes come too close: {words}: give another {home_key(robot)}"
    )


def refuse_touching_configurations(scene: Scene) -> None:
    """Refuse services and via points in which a robot comes too close to itself or to what does not move.

    Raises:
        InputError: With the bodies and their distance.
    """
    cell, alone = scene.cell, scene_of_run(scene, ())
    given = [(f"robots.{it.name}.service.at", it.name, it.service.posture) for it in cell.robots if it.service]
    for task in cell.tasks:
        for key, points in (("before", task.via_before), ("after", task.via_after)):
            place = f"tasks.{task.name}.via.{key}"
            stated = ((index, it) for index, it in enumerate(points) if isinstance(it, np.ndarray))
            given += [(f"{place}[{index}]", task.robot, at) for index, at in stated]
    moved = {robot.name: set(rows_moved_by(alone, robot.name)) for robot in cell.robots}
    for place, robot, at in given:
        others = set[int]().union(*(rows for name, rows in moved.items() if name != robot))
        by_itself, q = scene_of_rows(alone, sorted(moved[robot] - others)), np.zeros((2, cell.joint_count))
        q[:, cell.columns(robot)] = at
        if not certify(by_itself, q, with_minimum=False).is_met:
            words = nearest_words(by_itself, q)[0]
            raise InputError(f"{cell.origin.at(place)}: '{robot}' comes too close there: {words}: give another one")


@contextmanager
def located(stage: Stage, cell: Cell, given: Cell) -> Iterator[None]:
    """Errors of a stage with where they come from.

    Those of a straight move that grips or puts down the part stand at the place where the cell says that it lies. To
    those of later tasks it is added that the start posture of the holder was found for earlier ones.

    Raises:
        NoSolutionError: Of the same kind.
    """
    try:
        yield
    except NoSolutionError as error:
        if stage.move is None:
            first = cell.positioners[0] if cell.positioners else None
            if first is None or given.robot(first).start is not None or cell.robot(first).start is None:
                raise
            raise type(error)(
                f"{error}; '{first}' has the start posture that was found for earlier tasks: give "
                f"robots.{first}.start_deg, or holder_deg of these tasks"
            ) from error
        raise type(error)(f"{cell.origin.at(f'{_key(stage)}.at')}: the move '{stage.move}' fails: {error}") from error


@contextmanager
def named_transfer(stages: Sequence[Stage], number: int) -> Iterator[None]:
    """Errors of transfer moves with their name, and the tasks between which they are.

    Raises:
        BlockedTransferError: With the name.
    """
    try:
        yield
    except BlockedTransferError as error:
        before, after = stages[:number][-1:], stages[number + 1 :][:1]
        between = f"from {_words(before)} to {_words(after)}"
        raise error.of_phase(stages[number].phase.name, between) from error


def _words(stages: Sequence[Stage]) -> str:
    """A stage with its tasks; the homes where there is none."""
    if not stages:
        return HOME
    phase = stages[0].phase
    tasks = ", ".join(phase.tasks) if stages[0].move is None else ""
    return f"{phase.name} ({tasks})" if tasks else phase.name
