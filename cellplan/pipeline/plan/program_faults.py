"""Faults of a program from home to home that are known before its moves are planned, each at its place in the cell."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import scene_of_rows, scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.errors import HomeNotFoundError, InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.planning.sequence.part_moves import PartMove
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import Stage
from cellplan.planning.start.given import home_key, home_place
from cellplan.planning.transfer.reasons import nearest_words
from cellplan.scene.bodies import Kind
from cellplan.scene.mounting import Mount
from cellplan.scene.scene import Scene


def _key(stage: Stage) -> str:
    """Key of the place at which a straight move grips or puts down the part."""
    return "program.attach" if stage.move in (PartMove.GRIP, PartMove.LIFT) else "program.detach"


def refuse_sunk_parts(scenes: StageScenes) -> None:
    """Refuse places at which the part lies deep in a body of the environment.

    Raises:
        InputError: With the body and the depth.
    """
    cell = scenes.cell
    places = {"attach": cell.program.attach, "detach": cell.program.detach} if cell.program is not None else {}
    for key, place in places.items():
        if place is None:
            continue
        scene = scenes.with_part_at(place)
        parts = {body.name for body in scene.bodies if body.kind is Kind.PART}
        standing = [pair for pair in scene.mounted if pair.mount is Mount.STANDING]
        for check in check_mounting(replace(scene, mounted=tuple(standing)), np.zeros((1, cell.joint_count))):
            if not check.passed and parts & {*check.subject.split(" - ")}:
                raise InputError(f"{cell.origin.at(f'program.{key}.at')}: {check.message}")


def refuse_unnamed_support(stage: Stage, scene: Scene, q: Array) -> None:
    """Refuse a place at which the part is nearer to a body of the environment than allowed, and does not rest on it.

    Args:
        stage: The stage; only that which lifts the part, or lowers it, is judged.
        scene: Its scene, in which the part may touch the body that it rests on.
        q: Stacked joint positions of its rows in [rad] or [m], shape (N, nq).

    Raises:
        InputError: With the body and the distance.
    """
    if stage.move not in (PartMove.LIFT, PartMove.LOWER):
        return
    kinds = [{scene.bodies[pair.first].kind, scene.bodies[pair.second].kind} for pair in scene.pairs]
    own = scene_of_rows(scene, [row for row, both in enumerate(kinds) if both == {Kind.PART, Kind.OBSTACLE}])
    lying = q[[0 if stage.move is PartMove.LIFT else -1]].repeat(2, axis=0)
    if own.pairs and not certify(own, lying, with_minimum=False).is_kept:
        words, _ = nearest_words(own, lying)
        where = scene.cell.origin.at(f"{_key(stage)}.rests_on")
        raise InputError(f"{where}: {words} where the part lies: name the body that it rests on, or move the place")


def refuse_crowded_homes(scene: Scene, home: Array) -> None:
    """Refuse homes at which robots keep less distance than is demanded.

    Args:
        scene: The scene of the first or the last transfer move.
        home: Stacked homes of all robots in [rad] or [m], shape (nq,).

    Raises:
        HomeNotFoundError: With the bodies and their distance.
    """
    at_rest, cell, own = home[None].repeat(2, axis=0), scene.cell, scene_of_run(scene, ())
    if certify(own, at_rest, with_minimum=False).is_kept:
        return
    words, bodies = nearest_words(own, at_rest)
    robot = next(
        (robot for name in bodies for robot in cell.robots if name.startswith(f"{robot.name}/")), cell.robots[0]
    )
    raise HomeNotFoundError(
        f"{home_place(cell, robot)}: the homes come too close: {words}: give another {home_key(robot)}"
    )


@contextmanager
def located(stage: Stage, cell: Cell, given: Cell) -> Iterator[None]:
    """Errors of a stage with where they come from.

    Those of a straight move that grips or puts down the part stand at the place where the cell says that it lies. To
    those of later tasks it is added that the start posture of the holder was found for earlier ones.

    Args:
        stage: What is planned.
        cell: The cell with the starts that earlier stages found.
        given: The cell as it was written.

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
