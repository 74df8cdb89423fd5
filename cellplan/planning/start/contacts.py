"""Start contacts: which pairs of bodies touch in how many of the configurations that were tried."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import finite_limits, random_configurations
from cellplan.planning.start.trial_motion import StartTrials
from cellplan.scene.bodies import Kind, SceneBody

ANYWHERE: Final = 12  # configurations drawn from the whole range of a robot's joints


@dataclass(frozen=True, slots=True, kw_only=True)
class StartContact:
    """Two bodies that touch."""

    robot: str  # the robot whose configurations were evaluated
    bodies: tuple[SceneBody, SceneBody]  # the body of that robot first
    count: int  # in how many of them they touch
    of: int  # how many there were
    is_everywhere: bool = False  # whether they also touch wherever else the robot may be


def contacts_of(
    trials: StartTrials, cell: Cell, robot: Robot, tried: Sequence[tuple[Array, Array | None]]
) -> list[StartContact]:
    """Contacts of one robot with itself and with what does not depend on the other robots' choices, most often first.

    Args:
        cell: The cell in the order of names.
    """
    among = _robot_pairs(trials, cell, robot)
    counts: Counter[tuple[str, str]] = Counter()
    for q, holder_configuration in tried:
        counts.update(trials.contacts(_placed(cell, robot, q, holder_configuration), among=among))
    bodies = {body.name: body for body in trials.bodies}
    contacts = [
        StartContact(robot=robot.name, bodies=_robot_first(robot, bodies, pair), count=count, of=len(tried))
        for pair, count in counts.items()
    ]
    return sorted(contacts, key=lambda contact: (-contact.count, [body.name for body in contact.bodies]))


def touches_anywhere(
    trials: StartTrials, cell: Cell, contact: StartContact, holder_configuration: Array | None
) -> bool:
    """Whether two bodies touch at configurations from the whole range of their robot's joints as well."""
    robot = cell.robot(contact.robot)
    names = {body.name for body in contact.bodies}
    among = _robot_pairs(trials, cell, robot) & np.array([set(pair) == names for pair in trials.pair_names], dtype=bool)
    samples = random_configurations(robot.model, ANYWHERE, generator(f"{robot.name} anywhere", cell.solver.seed))
    return all(trials.contacts(_placed(cell, robot, q, holder_configuration), among=among) for q in samples)


def contacts_between(trials: StartTrials, tried: Sequence[Array]) -> list[tuple[tuple[str, str], int]]:
    """Pairs that touch in configurations of the whole cell, shape (nq,) each, with how often, most often first."""
    counts: Counter[tuple[str, str]] = Counter()
    for q in tried:
        counts.update(trials.contacts(q, among=trials.open_pairs))
    ordered = [((min(pair), max(pair)), count) for pair, count in counts.items()]
    return sorted(ordered, key=lambda entry: (-entry[1], entry[0]))


def _robot_pairs(trials: StartTrials, cell: Cell, robot: Robot) -> Flags:
    """Pairs of a body that the robot moves and one of its own or one that stands where it stands, shape (pairs,)."""
    given = {robot.name for robot in cell.robots if robot.start is not None} | {robot.name, *cell.positioners[:1]}

    def is_of_robot(body: SceneBody) -> bool:
        return body.robot == robot.name and not body.is_at_rest

    def is_settled(body: SceneBody) -> bool:
        return body.is_at_rest or body.robot in given

    pairs = [(trials.bodies[pair.first], trials.bodies[pair.second]) for pair in trials.pairs]
    flags = [(is_of_robot(a) and is_settled(b)) or (is_of_robot(b) and is_settled(a)) for a, b in pairs]
    return np.array(flags, dtype=bool) & trials.open_pairs


def _placed(cell: Cell, robot: Robot, q: Array, holder_configuration: Array | None) -> Array:
    """The whole cell with one robot and the positioner where they are desired, shape (nq,)."""
    whole = np.concatenate(
        [robot.start if robot.start is not None else np.clip(0.0, *finite_limits(robot.model)) for robot in cell.robots]
    )
    if holder_configuration is not None:
        whole[cell.columns(cell.positioners[0])] = holder_configuration
    whole[cell.columns(robot.name)] = q
    return whole


def _robot_first(robot: Robot, bodies: dict[str, SceneBody], pair: tuple[str, str]) -> tuple[SceneBody, SceneBody]:
    """Two bodies by name, that of the robot first; of two of its own a link after what it carries."""
    a, b = sorted((bodies[name] for name in pair), key=lambda body: body.name)
    if a.robot == b.robot:
        return (b, a) if a.kind is Kind.LINK and b.kind is not Kind.LINK else (a, b)
    return (a, b) if a.robot == robot.name else (b, a)
