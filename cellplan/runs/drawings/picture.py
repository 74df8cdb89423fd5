"""The picture of the instant that decides the verdict of a run: what stands where at it, and what matters."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.shapes import HalfSpace, support
from cellplan.geometry.transforms import transform_points
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import VerifiedMotion
from cellplan.model.robot.base_reaction import largest_reactions
from cellplan.model.task.task import Frame
from cellplan.model.units import MM
from cellplan.report.floor_plan.sheet import floor_plan_svg
from cellplan.report.plots.palette import robot_colours
from cellplan.report.record.numbers import floored
from cellplan.report.still.facets import facets
from cellplan.report.still.painter import mixed
from cellplan.report.still.picture import Colour, ShownLine, ShownName, ShownSolid, StillPicture
from cellplan.report.still.sheet import still_svg
from cellplan.runs.drawings.floor_plan import floor_plan, schedule_paths, swept_state
from cellplan.runs.drawings.instant import Instant, graver, heading, is_exact, worst_instant
from cellplan.runs.solution import Run
from cellplan.scene.bodies import Kind, SceneBody, body_poses, scene_bodies
from cellplan.scene.kinematics.screw_chain import Chains, ScrewChain

PATH_POINTS: Final = 81  # [-] of a path
CONTACT_SIDES: Final = 24  # [-] of round bodies where a place of contact is sought
INSIDE: Final = 1e-6  # [m] below a surface
MARKED: Final = "marked"
LIGHT_WASH, DARK_WASH = "#e9edf1", "#20262e"
GREYS: Final = {
    "part": Colour(light="#b9a26a", dark="#b9a26a"),
    "tool": Colour(light="#5c6670", dark="#8b96a1"),
    "stand": Colour(light="#a9b1ba", dark="#6d7782"),
    "thing": Colour(light="#c3cad2", dark="#566069"),
    MARKED: Colour(light="#e0352b", dark="#f0443a"),
    f"{MARKED}-2": Colour(light="#a3123f", dark="#b8174a"),
}
ROBOT: Final = "robot "  # begins the name of the colour of a robot; the space keeps it apart from all others
MUTED: Final = "muted "  # the same of a robot that does not matter here
MUTING: Final = 0.62  # [-]
STILL: Final = "still.svg"
FLOOR_PLAN: Final = "floor_plan.svg"


def run_still(cell: Cell, schedule: Schedule, report: Report) -> str:
    """SVG of the instant that decides the verdict of a run."""
    return still_svg(still_picture(cell, schedule, report))


def still_picture(cell: Cell, schedule: Schedule, report: Report) -> StillPicture:
    """What the picture of a run shows; see ``run_still``."""
    instant = worst_instant(report, cell)
    q = {name: _at(report.times, values, instant.at_s) for name, values in report.q.items()}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    bodies = [body for body in scene_bodies(cell) if not isinstance(body.shape, HalfSpace)]
    poses = body_poses(bodies, chains, q)
    marked = _marked(instant, cell, bodies)
    involved = {body.robot for body in bodies if body.name in marked} | {instant.robot}
    is_failed = instant.is_failure
    solids = []
    for index, body in enumerate(bodies):
        X_WS = np.eye(4)
        X_WS[:3, :3], X_WS[:3, 3] = poses.R[index, 0], poses.p[index, 0]
        material = _material(
            body, marked=marked if is_failed else frozenset(), involved=involved if is_failed else None
        )
        solids.append(ShownSolid(name=body.name, shape=body.shape, X_WS=X_WS, material=material, robot=body.robot))  # type: ignore[arg-type]
    mark, label = _mark(instant, cell, solids, chains=chains, q=q)
    title, notes = heading(instant, report)
    return StillPicture(
        title=title,
        notes=notes,
        is_bad=is_failed,
        solids=tuple(solids),
        lines=(*_paths(cell, schedule, chains, q), *_skeletons(cell, bodies, chains, q)),
        names=tuple(_names(cell, solids, bodies)),
        materials=materials(cell),
        mark=mark,
        label=label,
        floor=_floor(cell),
        marked=tuple(sorted(marked)),
    )


def _at(times: Array, q: Array, at_s: float) -> Array:
    """Joints at an instant, shape (1, n): they move linearly between the rows."""
    return np.array([[np.interp(at_s, times, column) for column in q.T]])


def _marked(instant: Instant, cell: Cell, bodies: Sequence[SceneBody]) -> frozenset[str]:
    """Names of the bodies that are shown as the failing ones."""
    if instant.bodies:
        return frozenset(instant.bodies)
    if instant.robot is None:
        return frozenset()
    bodies_of_robot = [body for body in bodies if body.robot == instant.robot and body.kind is not Kind.PART]
    if instant.joint is not None:
        model = cell.robot(instant.robot).model
        number = model.joint_names.index(instant.joint)
        moved = {link for link in range(len(model.axes)) if model.drive(link).joint == number}
        names = frozenset(body.name for body in bodies_of_robot if body.link in moved and body.kind is Kind.LINK)
        return names or frozenset(
            body.name for body in bodies_of_robot if body.kind is Kind.LINK and not body.is_at_rest
        )
    tools = frozenset(body.name for body in bodies_of_robot if body.kind is Kind.TOOL)
    return tools or frozenset(
        body.name for body in bodies_of_robot if body.link == cell.robot(instant.robot).model.flange_link
    )


def _material(body: SceneBody, *, marked: frozenset[str], involved: set[str | None] | None) -> str:
    """Name of the colour of a body."""
    if body.name in marked:
        return f"{MARKED}-2" if len(marked) == 2 and body.name == max(marked) else MARKED
    usual = {Kind.PART: "part", Kind.TOOL: "tool", Kind.PEDESTAL: "stand", Kind.OBSTACLE: "thing"}.get(body.kind)
    if usual is not None:
        return usual
    is_muted = involved is not None and len(involved - {None}) > 0 and body.robot not in involved
    return f"{MUTED if is_muted else ROBOT}{body.robot}"


def materials(cell: Cell) -> Mapping[str, Colour]:
    """All colours by name."""
    greys = dict(GREYS)
    for name, colour in robot_colours(cell).items():
        greys[f"{ROBOT}{name}"] = Colour(light=mixed(colour, "#ffffff", 0.12), dark=mixed(colour, "#ffffff", 0.12))
        greys[f"{MUTED}{name}"] = Colour(light=mixed(colour, LIGHT_WASH, MUTING), dark=mixed(colour, DARK_WASH, MUTING))
    return greys


def _mark(
    instant: Instant, cell: Cell, solids: Sequence[ShownSolid], *, chains: Chains, q: RobotRows
) -> tuple[Array, str]:
    """The points that matter in the world, and what is written beside them."""
    if instant.minimum is not None and instant.minimum.points is not None:
        least = "" if is_exact(instant.minimum) else "≥ "
        return np.array(instant.minimum.points), f"{least}{floored(MM * (instant.minimum.minimum or 0.0))} mm"
    if len(instant.bodies) == 2:
        return _between([solid for solid in solids if solid.name in instant.bodies]), ""
    if instant.robot is None:
        return np.zeros((0, 3)), ""
    label = "" if instant.check is None else f"{instant.check.value:.4g} {instant.check.unit}"
    if instant.joint is not None:
        robot = cell.robot(instant.robot)
        number = robot.model.joint_names.index(instant.joint)
        link = next(k for k in range(len(robot.model.axes)) if robot.model.drive(k).joint == number)
        D = chains[robot.name].link_displacements(q[robot.name])[0, link + 1]
        marked = [solid for solid in solids if solid.material == MARKED]
        point = transform_points(D, robot.model.axes[link].point_B[None])
        return (np.array([marked[0].X_WS[:3, 3]]) if marked else point), label
    return chains[instant.robot].tool_poses(q[instant.robot])[0][None, :3, 3], label


def _between(pair: Sequence[ShownSolid]) -> Array:
    """A place where two solids that touch are near each other, shape (1, 3); none unless there are two."""
    if len(pair) != 2:
        return np.zeros((0, 3))
    surfaces = []
    for solid in pair:
        corners = facets(solid.shape, CONTACT_SIDES)
        surfaces.append(corners @ solid.X_WS[:3, :3].T + solid.X_WS[:3, 3])
    clouds = [np.concatenate([surface.mean(axis=1), surface[:, 0]]) for surface in surfaces]
    sunk = [points[_inside(points, other)] for points, other in zip(clouds, reversed(surfaces), strict=True)]
    if any(map(len, sunk)):
        return np.concatenate(sunk).mean(axis=0)[None]
    squares = sum((clouds[0][:, None, k] - clouds[1][None, :, k]) ** 2 for k in range(3))
    first, second = np.unravel_index(int(np.argmin(np.round(squares, 9))), squares.shape)
    return 0.5 * (clouds[0][first] + clouds[1][second])[None]


def _inside(points: Array, surface: Array) -> Flags:
    """Which points lie behind all facets of a surface, shape (K, 4, 3): inside a convex one."""
    normals = np.cross(surface[:, 2] - surface[:, 0], surface[:, 3] - surface[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    offsets = np.einsum("ij,ij->i", normals, surface.mean(axis=1))
    return (points @ normals.T - offsets).max(axis=1) <= -INSIDE


def _paths(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows) -> list[ShownLine]:
    """The path of every task, where the part is."""
    paths = []
    for task in schedule.tasks:
        rows = np.unique(np.linspace(0, len(task.X_PT) - 1, PATH_POINTS).round().astype(np.intp))
        points = task.X_PT[rows, :3, 3]
        if task.task.relative_to is Frame.PART:
            points = transform_points(_part_pose(cell, chains, q), points)
        paths.append(ShownLine(points=points, material=f"{ROBOT}{task.task.robot}", width=3.2))
    return paths


def _part_pose(cell: Cell, chains: Chains, q: RobotRows) -> Array:
    """Pose of the part in the world, shape (4, 4)."""
    if not cell.part.held_by:
        return cell.part.X_CP
    holder = cell.part.held_by[0].robot
    return chains[holder].tool_poses(q[holder])[0] @ cell.part.X_CP


def _skeletons(cell: Cell, bodies: Sequence[SceneBody], chains: Chains, q: RobotRows) -> list[ShownLine]:
    """Robots without bodies as lines from axis to axis, and tools without bodies from the flange to their tips."""
    links = {body.robot for body in bodies if body.kind is Kind.LINK}
    tools = {body.robot for body in bodies if body.kind is Kind.TOOL}
    skeletons = []
    for robot in cell.robots:
        flange = chains[robot.name].flange_poses(q[robot.name])[0][:3, 3]
        tip = chains[robot.name].tool_poses(q[robot.name])[0][:3, 3]
        if robot.name not in links:
            D = chains[robot.name].link_displacements(q[robot.name])[0]
            axes = [
                D[link + 1][:3, :3] @ robot.model.axes[link].point_B + D[link + 1][:3, 3]
                for link in robot.model.links_to_flange
            ]
            points = np.array([robot.X_WB[:3, 3], *axes, flange])
            skeletons.append(ShownLine(points=points, material=f"{ROBOT}{robot.name}", width=9.0))
        if robot.name not in tools and not robot.tool.is_bare:
            skeletons.append(ShownLine(points=np.array([flange, tip]), material="tool", width=6.0))
    return skeletons


def _names(cell: Cell, solids: Sequence[ShownSolid], bodies: Sequence[SceneBody]) -> list[ShownName]:
    """Names of the robots, below what stands still of them."""
    labels = []
    for robot in cell.robots:
        at = robot.X_WB[:3, 3].copy()
        for solid, body in zip(solids, bodies, strict=True):
            if body.robot == robot.name and body.is_at_rest:
                down = solid.X_WS[:3, :3].T @ np.array([0.0, 0.0, -1.0])
                at[2] = min(at[2], solid.X_WS[2, 3] - float(support(solid.shape, down)))
        labels.append(ShownName(text=robot.name, at=at))
    return labels


def _floor(cell: Cell) -> float | None:
    """Height of the highest level half-space among the surroundings; without one that of the lowest base."""
    heights = [
        float(thing.X_WS[2, 3])
        for thing in cell.obstacles
        if isinstance(thing.shape, HalfSpace) and thing.X_WS[2, 2] > 1.0 - 1e-6
    ]
    return max(heights) if heights else None


DepictedPhase = Run | VerifiedMotion


def phase_drawings(phase: DepictedPhase) -> dict[str, str]:
    """The drawings of one phase, by file name."""
    return {STILL: run_still(phase.cell, phase.schedule, phase.report), FLOOR_PLAN: _floor_plan(phase.cell, [phase])}


def drawings_by_place(cell: Cell, phases: Sequence[DepictedPhase]) -> dict[str, dict[str, str]]:
    """The drawings of a program and of its phases, by their places in the folder of the run and by file name."""
    drawings = {phase.report.phase or "": phase_drawings(phase) for phase in phases}
    return drawings if "" in drawings else {**drawings, "": program_drawings(cell, phases)}


def program_drawings(cell: Cell, phases: Sequence[DepictedPhase]) -> dict[str, str]:
    """The drawings of a program with several phases: the picture of the one that decides, and all of its motion."""
    worst = min(phases, key=lambda phase: graver(worst_instant(phase.report, phase.cell)))
    return {STILL: run_still(worst.cell, worst.schedule, worst.report), FLOOR_PLAN: _floor_plan(cell, phases)}


def _floor_plan(cell: Cell, phases: Sequence[DepictedPhase]) -> str:
    """The floor plan at the begin of the first phase, with what all phases sweep."""
    motions = [phase.report.q for phase in phases]
    paths = {name: points for phase in phases for name, points in schedule_paths(phase.schedule).items()}
    whole = sum(phase.report.cycle_time for phase in phases)
    start = {name: q[0] for name, q in motions[0].items()}
    reactions = largest_reactions(it.reaction for phase in phases for it in phase.report.torques)
    return floor_plan_svg(floor_plan(cell, start, motions, paths, state=swept_state(whole), reactions=reactions))
