"""Pairs that touch, or come near, in every posture: the robot's own design or the coarseness of its bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses, checked_poses
from cellplan.collision.certificate import heights
from cellplan.collision.engine import Engine
from cellplan.collision.inside import is_inside
from cellplan.collision.measure import measure
from cellplan.geometry.transforms import Array
from cellplan.kinematics.screws import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.robot import RobotModel
from cellplan.scene.bodies import Kind, SceneBody, body_poses, is_ground, part_body
from cellplan.scene.pairs import Excluded, Rule, ScenePair, near_in_chain, stands_on

POSTURES: Final = 48  # random postures beside the reference; a pair that is free in one of ten escapes 0.6 % of trials
SEED: Final = 0  # the rule is the same for every run
HARDLY: Final = 1e-3  # [m] a distance that varies by less over all postures is a matter of mounting, not of motion
ENDLESS: Final = np.pi  # [rad] or [m] range sampled to either side of zero where a joint has no limit


def apply_design(
    cell: Cell,
    bodies: Sequence[SceneBody],
    pairs: Sequence[ScenePair],
    *,
    engine: Engine,
    chains: Mapping[str, ScrewChain],
) -> tuple[list[ScenePair], list[Excluded]]:
    """Leave out what always touches, and ask only for "no contact" where the robot's own design sets the distance.

    Looked at are pairs of one robot with at most two joints between them, or with a bar of a linkage, at the reference
    posture and at random ones within the joint limits:

    - touching in all of them: left out;
    - two links: checked for contact, not for distance;
    - a tool or a held part against a link, nearer than the demanded clearance in all of them: likewise;
    - a tool or a held part against a link, at a distance that hardly changes between them: likewise.

    A robot whose foot has no body may stand with its first link in the surroundings, if it does so in every posture.
    The links of each robot that holds the part are looked at as if it were the one that carries it.
    """
    views = _views(cell, bodies)
    postures = _postures(cell)
    sampled: dict[str | None, BodyPoses] = {}
    kept, excluded = [], []
    for pair in pairs:
        holder = _further_holder(pair, bodies, views)
        seen = views[holder]
        is_near = near_in_chain(pair, seen, cell=cell)
        if not is_near and not stands_on(pair, bodies, cell=cell):
            kept.append(pair)
            continue
        if holder not in sampled:
            sampled[holder] = checked_poses(body_poses(seen, chains, postures))
        if _always_touch(engine, bodies, pair, poses=sampled[holder]):
            reason = f"touch at the reference posture and at {POSTURES} random ones: it is their shape, not the motion"
            excluded.append(Excluded(pair.first, pair.second, reason))
        elif is_near:
            kept.append(_relaxed(pair, bodies, engine=engine, poses=sampled[holder], clearance=cell.checks.clearance))
        else:
            kept.append(pair)
    return kept, excluded


def _views(cell: Cell, bodies: Sequence[SceneBody]) -> dict[str | None, Sequence[SceneBody]]:
    """The bodies as they are, and with the part on each further holder whose grasp leaves nothing open."""
    views: dict[str | None, Sequence[SceneBody]] = {None: bodies}
    for grasp in cell.closures:
        if len(grasp.axes) == 6:
            held = part_body(cell, cell.part, grasp)
            views[grasp.robot] = [held if body.kind is Kind.PART else body for body in bodies]
    return views


def _further_holder(
    pair: ScenePair, bodies: Sequence[SceneBody], views: Mapping[str | None, Sequence[SceneBody]]
) -> str | None:
    """The further holder that a pair belongs to, when the pair is one of its bodies and the part."""
    ends = (bodies[pair.first], bodies[pair.second])
    owner = next((body.robot for body in ends if body.kind is not Kind.PART), None)
    return owner if any(body.kind is Kind.PART for body in ends) and owner in views else None


def _postures(cell: Cell) -> dict[str, Array]:
    """Reference posture and random ones within the limits, by robot, shape (POSTURES + 1, n)."""
    rng = np.random.default_rng(SEED)
    return {robot.name: _random_postures(robot.model, rng) for robot in cell.robots}


def _random_postures(model: RobotModel, rng: np.random.Generator) -> Array:
    """Reference posture first, then random ones."""
    lower = np.where(np.isfinite(model.lower), model.lower, -ENDLESS)
    upper = np.where(np.isfinite(model.upper), model.upper, ENDLESS)
    q = rng.uniform(lower, upper, size=(POSTURES + 1, len(model.joints)))
    q[0] = 0.0
    return q


def _always_touch(engine: Engine, bodies: Sequence[SceneBody], pair: ScenePair, *, poses: BodyPoses) -> bool:
    """Whether two bodies touch at every sample."""
    first, second = pair.first, pair.second
    if is_ground(bodies[second]):
        height = heights(engine.bodies[first].hull, poses.R[first], poses.p[first], X_WS=bodies[second].X_BS)
        return bool(np.all(height <= 0.0))
    return all(
        engine.touch(first, second, poses, sample=k) or is_inside(engine, (first, second), poses, sample=k)
        for k in range(poses.p.shape[1])
    )


def _relaxed(
    pair: ScenePair, bodies: Sequence[SceneBody], *, engine: Engine, poses: BodyPoses, clearance: float
) -> ScenePair:
    """The pair, checked for contact only where the distance between the two is a matter of design."""
    first, second = pair.first, pair.second
    if bodies[first].kind is bodies[second].kind is Kind.LINK:
        reason = "checked for contact only: two joints apart, their distance is set by the robot's design"
        return replace(pair, rule=Rule.CONTACT, reason=reason)
    distances = [measure(engine, (first, second), poses, sample=k).bound for k in range(poses.p.shape[1])]
    if max(distances) < clearance:
        reason = "checked for contact only: nearer than the demanded clearance in every posture by its mounting"
        return replace(pair, rule=Rule.CONTACT, reason=reason)
    if max(distances) - min(distances) <= HARDLY:
        shown = 1e3 * min(distances)
        reason = f"checked for contact only: {shown:.0f} mm apart in every posture, the mounting sets their distance"
        return replace(pair, rule=Rule.CONTACT, reason=reason)
    return pair
