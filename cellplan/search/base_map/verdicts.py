"""What becomes of the whole job at each place of one base: of the first start that passes, or the best one."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.certify.depths import mounted_depths
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell.cell import Timing, joint_at
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.scene.scene import Scene, stands_by_link
from cellplan.search.base_map.places import Places
from cellplan.search.kernel.figures import MotionFigures, Peaks
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import run

KEYS: Final = (3, 9, 33)  # [-] nodes at which distances are asked, more and more while nothing is too near
QUERIED_AT_ONCE: Final = 128  # [-] configurations placed together: about 10 MB
AT_ONCE: Final = 256  # [-] motions worked out together


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceContact:
    """Two bodies that are too near."""

    pair: tuple[str, str]  # their names
    distance: float  # their distance in [m], negative where they overlap by so much
    node: int  # node of the motion at which it is so


def contacts(scene: Scene, robot: str, X_WB: Array, q: Array, *, standing: bool = True) -> list[PlaceContact | None]:
    """The worst contact of each motion at the first nodes that show one; None for a motion without any.

    Args:
        X_WB: Its base for each motion, shape (K, 4, 4).
        q: The motions, shape (K, N, nq).
    """
    if stands_by_link(scene.cell, robot) and len(q) > 1:  # its pairs depend on where it stands
        slices = (slice(k, k + 1) for k in range(len(q)))
        return [contacts(scene, robot, X_WB[k], q[k], standing=standing)[0] for k in slices]
    touching: list[PlaceContact | None] = [None] * len(q)
    if not len(q):
        return touching
    placed = scene.moved({robot: X_WB[0]})
    places, seen = np.arange(len(q)), np.zeros(q.shape[1], dtype=bool)
    for count in KEYS:
        nodes = np.unique(np.linspace(0, q.shape[1] - 1, count).round().astype(np.intp))
        nodes = nodes[~seen[nodes]]
        seen[nodes] = True
        step = max(1, QUERIED_AT_ONCE // max(1, len(nodes)))
        for some in (places[begin : begin + step] for begin in range(0, len(places), step)):
            for place, contact in _worst(placed, robot, X_WB[some], q[some][:, nodes]).items():
                touching[some[place]] = PlaceContact(
                    pair=contact.pair, distance=contact.distance, node=int(nodes[contact.node])
                )
        places = np.array([place for place in places.tolist() if touching[place] is None], dtype=np.intp)
    for place in places.tolist() if standing else ():
        touching[place] = _standing(scene.moved({robot: X_WB[place]}), q[place, :1])
    return touching


def _worst(scene: Scene, robot: str, X_WB: Array, q: Array) -> dict[int, PlaceContact]:
    """The worst contact of motions of shape (K, nodes, nq), by motion and node, for those that have one."""
    table, (count, nodes, joints) = scene.near_table, q.shape
    bases = np.array([np.tile(robot.X_WB, (count * nodes, 1, 1)) for robot in scene.cell.robots])
    bases[scene.cell.index(robot)] = np.repeat(X_WB, nodes, axis=0)
    demands = np.zeros(len(scene.pairs))
    demands[table.pairs.rows] = table.pairs.demands
    D = table.forest.displacements(q.reshape(-1, joints), bases)
    near = table.find(scene.engine, D, float(demands.max(initial=0.0)))
    short, motions = near.distances - demands[near.rows], near.samples // nodes
    worst = dict[int, PlaceContact]()
    for query in _worst_pairs(short, motions).tolist():
        pair = scene.names(scene.pairs[near.rows[query]])
        node = int(near.samples[query] % nodes)
        worst[int(motions[query])] = PlaceContact(pair=pair, distance=float(near.distances[query]), node=node)
    return worst


def _worst_pairs(short: Array, motions: Indices) -> Indices:
    """Of each motion the pair that falls short by most, of those that do."""
    below = np.flatnonzero(short < 0.0)
    order = below[np.lexsort((short[below], motions[below]))]
    _, first = np.unique(motions[order], return_index=True)
    return order[first]


def _standing(scene: Scene, q: Array) -> PlaceContact | None:
    """The first pair of which one stands too deep in the other, at a configuration of shape (1, nq)."""
    table = scene.near_table
    D = table.forest.displacements(q, np.array([robot.X_WB for robot in scene.cell.robots]))
    for mounted_depth in mounted_depths(scene, q, table.bodies.poses(D)):
        if mounted_depth.depth > mounted_depth.pair.limit:
            names = (scene.bodies[mounted_depth.pair.first].name, scene.bodies[mounted_depth.pair.second].name)
            return PlaceContact(pair=names, distance=-mounted_depth.depth, node=0)
    return None


class Verdict(StrEnum):
    """What becomes of a place, the nearer to passing the later; one that is not judged is not known."""

    NOT_JUDGED = "not_judged"
    OUT_OF_REACH = "out_of_reach"
    LIMIT = "limit"
    SPEED = "speed"
    COLLISION = "collision"
    PASSES = "passes"


RANK: Final = {verdict: rank for rank, verdict in enumerate(Verdict)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaceVerdict:
    """One place."""

    verdict: Verdict  # what becomes of it
    start: Array | None = None  # start posture of the robot in [rad] or [m], shape (n,); None where there is none
    lost_at: float | None = None  # time in [s] at which a tool could not follow; None where all did
    joint: tuple[str, str] | None = None  # robot and joint beyond a limit, or that leaves least; None without limits
    margin: float | None = None  # its smallest distance from a limit in [rad] or [m]; None without limits
    fast: tuple[str, str] | None = None  # robot and joint that is fastest against its limits of speed and acceleration
    speed: float | None = None  # largest speed of any joint as a share of its limit; None where there is no motion
    acceleration: float | None = None  # largest acceleration likewise
    cycle: float | None = None  # shortest time in [s] of the same motion, faster or slower as a whole, that keeps both
    pair: tuple[str, str] | None = None  # bodies too near each other, and their distance in [m]; None without any
    distance: float | None = None  # that distance
    at: float | None = None  # time in [s] at which they are
    phase: int = 0  # the phase of work by which it fails
    starts: tuple[Array, ...] = ()  # start posture in each phase, where there are several and the place passes
    reason: str = ""  # why it is not judged; empty where it is

    @property
    def passes(self) -> bool:
        """Whether the whole job can be done."""
        return self.verdict is Verdict.PASSES

    def or_better(self, other: "PlaceVerdict | None") -> "PlaceVerdict":
        """This one where it is nearer to passing than an earlier one of the same place, else the earlier one."""
        return self if other is None or other.start is None or RANK[self.verdict] > RANK[other.verdict] else other


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapJob:
    """One phase of work of a cell with one robot at many places."""

    name: str  # its tasks, or what it is; empty for the only phase
    job: Job  # the tasks at their nodes
    scene: Scene  # the cell made computable; of its mounted pairs those that depend on its place
    robot: str  # name of the robot
    start: Array  # start configuration of the whole cell in [rad] or [m], shape (nq,)
    places: Places

    @property
    def works(self) -> bool:
        """Whether the robot has a task in this phase."""
        return any(relation.robot == self.robot for relation in self.job.relations)


def verdicts_at_start(job: MapJob, q: Array, at: Indices) -> tuple[list[PlaceVerdict], Indices]:
    """What the starts alone say of every place, and which starts are within limits.

    Args:
        q: Starts of the robot, shape (S, n), as ``starts_at`` returns them.
        at: Their places, shape (S,).

    Returns:
        The verdict of every place, and the starts to be judged, ascending.
    """
    model = job.scene.cell.robot(job.robot).model
    margins = np.minimum(q - model.lower, model.upper - q)
    verdicts = [PlaceVerdict(verdict=Verdict.OUT_OF_REACH) for _ in range(len(job.places))]
    for start, place, spare in zip(q, at.tolist(), margins, strict=True):
        tight = int(np.argmin(spare))
        worst = verdicts[place].margin
        if spare[tight] < 0.0 and (worst is None or spare[tight] > worst):
            joint = (job.robot, model.joint_names[tight])
            margin = float(spare[tight])
            verdicts[place] = PlaceVerdict(verdict=Verdict.LIMIT, start=start, joint=joint, margin=margin, at=0.0)
    return verdicts, np.flatnonzero(margins.min(axis=1) >= 0.0)


def judge(job: MapJob, q: Array, at: Indices) -> dict[int, PlaceVerdict]:
    """The verdict of each place of some starts by its motions: of the first that passes, else of the best one.

    Args:
        q: Starts of the robot within its limits, shape (S, n).
        at: Their places, ascending, shape (S,); at each place those that are tried first come first.
    """
    verdicts = dict[int, PlaceVerdict]()
    turn = np.arange(len(at)) - np.searchsorted(at, at, side="left")
    for rows in (np.flatnonzero(turn == 0), np.flatnonzero(turn > 0)[np.argsort(turn[turn > 0], kind="stable")]):
        left = rows[[place not in verdicts or not verdicts[place].passes for place in at[rows].tolist()]]
        left = left[~_is_in_vain(job, verdicts, q[left], at[left])]
        for begin in range(0, len(left), AT_ONCE):
            group = left[begin : begin + AT_ONCE]
            group = group[[place not in verdicts or not verdicts[place].passes for place in at[group].tolist()]]
            for place, verdict in zip(at[group].tolist(), _judged(job, q[group], at[group]), strict=True):
                verdicts[place] = verdict.or_better(verdicts.get(place))
    return verdicts


def judge_phases(jobs: Sequence[MapJob], starts: Sequence[tuple[Array, Indices]]) -> dict[int, PlaceVerdict]:
    """The verdict of each place over all phases, one after the other while none fails; see ``judge``.

    Args:
        starts: For each phase starts of the robot within its limits and their places, the same places in all phases.
    """
    judged: dict[int, list[PlaceVerdict]] = {place: [] for place in starts[0][1].tolist()}
    for phase, (job, (q, at)) in enumerate(zip(jobs, starts, strict=True)):
        left = [all(verdict.passes for verdict in judged[place]) for place in at.tolist()]
        for place, verdict in judge(job, q[left], at[left]).items():
            judged[place].append(replace(verdict, phase=phase))
    return {place: over_phases(verdicts) for place, verdicts in judged.items()}


def over_phases(verdicts: Sequence[PlaceVerdict]) -> PlaceVerdict:
    """The verdict of a place from those of its phases: the first that fails, else the worst figures of all.

    The cycle is then the sum of those of the phases.
    """
    failed = next((verdict for verdict in verdicts if not verdict.passes), None)
    if failed is not None or len(verdicts) == 1:
        return failed or verdicts[0]
    tight = min(verdicts, key=lambda verdict: np.inf if verdict.margin is None else verdict.margin)
    fast = max(verdicts, key=lambda verdict: max(verdict.speed or 0.0, np.sqrt(verdict.acceleration or 0.0)))
    return replace(
        verdicts[0],
        joint=tight.joint,
        margin=tight.margin,
        fast=fast.fast,
        speed=fast.speed,
        acceleration=fast.acceleration,
        cycle=sum(verdict.cycle or 0.0 for verdict in verdicts),
        phase=0,
        starts=tuple(verdict.start for verdict in verdicts if verdict.start is not None),
    )


def _is_in_vain(job: MapJob, verdicts: Mapping[int, PlaceVerdict], q: Array, at: Indices) -> Flags:
    """Starts that need no motion: two bodies are too near already there, and at their place nothing else is known."""
    collides = [place in verdicts and verdicts[place].verdict is Verdict.COLLISION for place in at.tolist()]
    asking = np.flatnonzero(np.array(collides, dtype=bool))
    start = np.tile(job.start, (len(asking), 1, 1))
    start[:, 0, job.scene.cell.columns(job.robot)] = q[asking]
    touching = contacts(job.scene, job.robot, job.places.X_WB[at[asking]], start, standing=False)
    is_vain = np.zeros(len(at), dtype=bool)
    is_vain[asking] = [contact is not None for contact in touching]
    return is_vain


def _judged(map_job: MapJob, q: Array, at: Indices) -> Iterator[PlaceVerdict]:
    """Verdicts of some starts, their motions worked out together."""
    job, cell = map_job.job, map_job.scene.cell
    X_WB = np.tile(np.array([robot.X_WB for robot in cell.robots]), (len(q), 1, 1, 1))
    X_WB[:, cell.index(map_job.robot)] = map_job.places.X_WB[at]
    start = np.tile(map_job.start, (len(q), 1))
    start[:, cell.columns(map_job.robot)] = q
    weights = np.concatenate([robot.weights for robot in cell.robots])
    tools = np.array([robot.tool.X_FT for robot in cell.robots])
    layouts = Layouts(
        X_WB=X_WB, X_FT=np.tile(tools, (len(q), 1, 1, 1)), start=start, weights=np.tile(weights, (len(q), 1))
    )
    motions = run(job, layouts)
    with np.errstate(all="ignore"):  # what lost its path is no number
        figures = MotionFigures.of(job, motions)
        allowed = acceleration_limits(map_job.scene.cell)
        rates = Peaks.of(job.times, job.rates @ (motions.qd / allowed), in_magnitude=True).value
    known = {
        k: _known(map_job, q[k], figures.margins[k], figures.speeds.value[k], rates[k])
        for k in np.flatnonzero(motions.is_followed).tolist()
    }
    _with_contacts(map_job, known, motions.q, map_job.places.X_WB[at])
    for k in range(len(q)):
        lost_at = float(max(motions.lost_at[k], 0.0))
        yield known.get(k, PlaceVerdict(verdict=Verdict.OUT_OF_REACH, start=q[k], lost_at=lost_at))


def _known(job: MapJob, start: Array, margins: Array, speeds: Array, rates: Array) -> PlaceVerdict:
    """What is known of a motion that all tools follow, without the bodies: figures of its joints, shape (nq,) each."""
    cell = job.scene.cell
    tight, times = int(np.argmin(margins)), np.maximum(speeds, np.sqrt(rates))
    fastest = int(np.argmax(times))
    known = PlaceVerdict(
        verdict=Verdict.PASSES,
        start=start,
        joint=joint_at(cell, tight) if margins[tight] < np.inf else None,
        margin=float(margins[tight]) if margins[tight] < np.inf else None,
        fast=joint_at(cell, fastest),
        speed=float(speeds.max()),
        acceleration=float(rates.max()),
        cycle=float(job.job.times[-1] * times[fastest]),
    )
    if margins[tight] < 0.0:
        return replace(known, verdict=Verdict.LIMIT)
    if times[fastest] > 1.0 and cell.motion.timing is Timing.AS_WRITTEN:
        return replace(known, verdict=Verdict.SPEED)
    return known


def _with_contacts(job: MapJob, known: dict[int, PlaceVerdict], q: Array, X_WB: Array) -> None:
    """Make collisions of those that pass in which two bodies are too near at a node, or one stands too deep in another.

    Args:
        known: What is known of some motions without the bodies, by motion.
        q: All motions, shape (K, N, nq).
        X_WB: Bases of the robot, shape (K, 4, 4).
    """
    passing = [motion for motion, verdict in known.items() if verdict.verdict is Verdict.PASSES]
    touching = contacts(job.scene, job.robot, X_WB[passing], q[passing])
    for motion, contact in zip(passing, touching, strict=True):
        if contact is not None:
            known[motion] = replace(
                known[motion],
                verdict=Verdict.COLLISION,
                pair=contact.pair,
                distance=contact.distance,
                at=float(job.job.times[contact.node]),
            )


def best_first(verdicts: Sequence[PlaceVerdict]) -> list[int]:
    """Places that pass: the shortest cycle first, of equal ones the widest margin, then the first one."""
    passing = [place for place, verdict in enumerate(verdicts) if verdict.verdict is Verdict.PASSES]
    return sorted(
        passing, key=lambda place: (round(verdicts[place].cycle or 0.0, 6), -round(verdicts[place].margin or 0.0, 6))
    )


def counts(verdicts: Sequence[PlaceVerdict]) -> dict[Verdict, int]:
    """How many places each verdict has, the best verdict first; places that are not judged only where there are any."""
    number = Counter(verdict.verdict for verdict in verdicts)
    return {kind: number[kind] for kind in reversed(Verdict) if number[kind] or kind is not Verdict.NOT_JUDGED}
