"""Conversion of the entries of a cell file, in millimetres and degrees, to the model in metres and radians."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.files.cell.build.accelerations import acceleration_rule, controller_cycle
from cellplan.files.cell.build.grips import grip_bodies, gripper_bodies
from cellplan.files.cell.build.mounting import build_attachments, build_mount, rail_bodies, with_floor_height
from cellplan.files.cell.build.path import TargetReader, path_fields
from cellplan.files.cell.rules.path_rules import build_path
from cellplan.files.cell.rules.rules import needs_surface
from cellplan.files.robots.rules import Given, home_configuration, start_posture
from cellplan.files.schema import CellDocument
from cellplan.files.schema.cell import CycleEntry, GraspEntry, MotionEntry
from cellplan.files.schema.messages import fields_of
from cellplan.files.schema.robot import JointSumEntry, RobotEntry, ServiceEntry
from cellplan.files.schema.seam import PathEntry
from cellplan.files.schema.shapes import ObstacleEntry
from cellplan.files.schema.task import BlendEntry, CornerChoice, TaskEntry, TrapezoidEntry, ViaEntry
from cellplan.files.schema.tool import OF_ROD, RodEntry, ToolEntry
from cellplan.files.shapes import MeshReader, centred_solid, direction, obstacle_shape, tool_solid
from cellplan.geometry.step.part import StepPart
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Grasp, Mode, MotionSettings, Obstacle, Part, Robot, Timing, Tool
from cellplan.model.cell.rod import Holder, Rod, tool_body_name
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import BASE, Body, JointSum, RobotModel, configuration_in_si
from cellplan.model.settings.task import ProcessEntry, ToleranceEntry, tilt_of
from cellplan.model.settings.units import Mm, MmPerS, in_si, si_or_none
from cellplan.model.task.task import (
    Frame,
    OffPart,
    PathSpec,
    ProgrammedPath,
    Service,
    StraightMove,
    Task,
    TimeLaw,
    TimeLawKind,
    ViaPoint,
)
from cellplan.model.units import MM

COMPONENTS: Final = ("x", "y", "z", "rx", "ry", "rz")
PLANE_NORMAL: Final = {"xy": "z", "yz": "x", "xz": "y"}


def build_robot(name: str, document: CellDocument, model: RobotModel, read_mesh: MeshReader) -> Robot:
    """A robot placed in the cell; settings that it does not state are those of the cell.

    The home of a robot that has nothing to do in the cell, and of which nothing but the start is given, is its start.
    """
    entry = document.robots[name]
    weights = np.ones(len(model.joints)) if entry.weights is None else np.array(entry.weights)
    path, home = build_path(entry.path, model), home_configuration(entry, model)
    start = start_posture(entry, model) if path is None else path.start
    at_work = {task.robot for task in document.tasks.values()} | {grasp.robot for grasp in document.part.held_by}
    if name not in at_work and entry.home_deg is None and entry.home is None:
        home = start
    return Robot(
        name=name,
        model=replace(model, bodies=(*rail_bodies(entry, read_mesh), *model.bodies)),
        X_WB=entry.base.matrix,
        tool=build_tool(entry.tool, read_mesh),
        start=start,
        path=path,
        null_space=build_path(entry.null_space, model),
        weights=weights,
        home=home,
        acceleration=acceleration_rule(entry, document.acceleration, joints=len(model.joints)),
        controller_cycle=controller_cycle(entry, document),
        controller_share=entry.controller_share,
        attachments=build_attachments(entry.attachments, model, read_mesh),
        pedestal=build_mount(entry, document.environment),
        gripper=gripper_bodies(entry, model),
        order=_order(name, document),
        control=entry.controller,
        service=_service(entry.service, model),
        joint_sums=tuple(_joint_sum(it, model) for it in entry.joint_sums),
    )


def _joint_sum(entry: JointSumEntry, model: RobotModel) -> JointSum:
    """A range of a sum of joint angles."""
    names = [joint.name for joint in model.joints]
    low, high = entry.range_deg
    columns = tuple(names.index(name) for name in entry.joints)
    return JointSum(joints=entry.joints, columns=columns, lower=low.si, upper=high.si)


def _service(entry: ServiceEntry | None, model: RobotModel) -> Service | None:
    """How the tool of a robot is cleaned."""
    if entry is None:
        return None
    return Service(posture=configuration_in_si(model, entry.at), takes=entry.takes_s, most=entry.every.seams)


def _order(robot: str, document: CellDocument) -> tuple[str, ...]:
    """Tasks and marks of a robot in their order; none in a cell without a program."""
    if document.program is None:
        return ()
    order = document.robots[robot].order
    return tuple(name for name, task in document.tasks.items() if task.robot == robot) if order is None else order


def build_part(
    document: CellDocument, models: Mapping[str, RobotModel], read_mesh: MeshReader, step: StepPart | None
) -> Part:
    """The workpiece, held by robots with their models; ``step`` is what its STEP file has, if it comes from one."""
    entry = document.part
    if entry.geometry is not None:
        shape, X_PS = centred_solid(entry.geometry, read_mesh)
    elif step is not None:
        shape, X_PS = step.mesh, np.eye(4)
    else:
        raise ValueError("a part without a shape")
    return Part(
        shape=shape,
        X_PS=X_PS,
        held_by=tuple(
            Grasp(
                robot=grasp.robot,
                X_PT=grasp.at.matrix,
                axes=_axis_numbers(grasp.axes),
                depth=grasp.depth_mm.si,
                bodies=grip_bodies(grasp.grip_bodies, grasp.robot, document.robots[grasp.robot], models[grasp.robot]),
                stiffness=_stiffness(grasp),
                closure_error=(grasp.closure_error_mm.si, grasp.closure_error_deg.si),
                grip=grasp.grip,
            )
            for grasp in entry.held_by
        ),
        X_WP=None if entry.at is None else entry.at.matrix,
        mass=entry.mass_kg,
        centre=None if entry.centre_mm is None else in_si(entry.centre_mm),
        accuracy=0.0 if step is None else step.deviation,
    )


def _stiffness(entry: GraspEntry) -> tuple[float, float] | None:
    """Stiffness of a grasp in [N/m] and [N m/rad]; None when it is not stated."""
    if entry.stiffness_n_mm is None and entry.stiffness_nm_deg is None:
        return None
    force, moment = si_or_none(entry.stiffness_n_mm), si_or_none(entry.stiffness_nm_deg)
    return force or np.inf, moment or np.inf


def build_obstacle(name: str, entry: ObstacleEntry, read_mesh: MeshReader) -> Obstacle:
    """A fixed obstacle."""
    shape, X_WS = obstacle_shape(entry, read_mesh)
    return Obstacle(name=name, shape=shape, X_WS=X_WS)


def build_task(
    name: str, document: CellDocument, models: Mapping[str, RobotModel], read_targets: TargetReader, origin: Origin
) -> Task:
    """The task of one operator; settings that it does not state are those of the motion."""
    entry, motion = document.tasks[name], document.motion
    (tool_axis, tool_x), fields = tool_directions(entry), path_fields(name, document, read_targets)
    return Task(
        name=name,
        robot=entry.robot,
        **fields,
        tool_axis=None if tool_axis is None else direction(tool_axis),
        tool_x=direction(tool_x),
        spin=entry.spin_deg.si,
        turn=entry.tool_turn_deg.si,
        axes=_axis_numbers(entry.axes),
        is_spin_free="spin" in entry.free,
        tilt=tilt_of(entry.free),
        tolerance=_tracking_tolerance(entry),
        start=entry.begins_s,
        duration=entry.duration_s,
        **_speeds(entry, motion, fields["path"]),
        blend=_blend(entry.corners or motion.corners),
        settle=entry.settle_s,
        repeat=entry.repeat,
        approach=_straight_move(entry.approach_mm, entry.approach_s),
        retract=_straight_move(entry.retract_mm, entry.retract_s),
        dwell=entry.dwell_s,
        relative_to=Frame(entry.relative_to),
        tool_depth=(document.checks.tool_depth_mm if entry.tool_depth_mm is None else entry.tool_depth_mm).si,
        standoff=None if entry.standoff_mm is None else (entry.standoff_mm[0].si, entry.standoff_mm[1].si),
        off_part=tuple(OffPart(name) for name in entry.off_part),
        torch=entry.torch,
        weld_position=entry.weld_position,
        is_tack=entry.tack,
        after=entry.preceding,
        start_posture=_posture(entry.given_start, models, entry.robot),
        holder_posture=_posture(entry.given_holder, models, *(it.robot for it in document.part.held_by[:1])),
        holder_moves=bool(entry.holder_moves),
        **_via_points(entry.via or ViaEntry(), models[entry.robot], document.robots[entry.robot]),
        origin=origin,
    )


def _tracking_tolerance(entry: TaskEntry) -> ToleranceEntry:
    """What smoothing leaves of the tolerance of a task for the errors of its tool on the smoothed path."""
    tolerance, smooth = entry.tolerance.filled, entry.path.smooth
    if smooth is None:
        return tolerance
    position, direction = smooth.position_mm or 0.0, smooth.direction_deg or 0.0
    return tolerance.changed(
        position_mm=tolerance.position_mm - position,
        between_rows_mm=(tolerance.between_rows_mm or tolerance.position_mm) - position,
        orientation_deg=tolerance.orientation_deg - direction,
        between_rows_deg=(tolerance.between_rows_deg or tolerance.orientation_deg) - direction,
    )


def _speeds(entry: TaskEntry, motion: MotionEntry, path: PathSpec) -> dict[str, Any]:
    """Process, feed and time law of a task, by field; with feeds of a file the process has the greatest of these."""
    process, feed = entry.process, si_or_none(entry.feed_mm_s)
    if isinstance(path, ProgrammedPath):
        process = (process or ProcessEntry()).changed(feed_mm_s=MmPerS(MM * float(path.feeds[-1])))
        feed = float(path.speeds.max())
    elif process is not None:
        feed = process.feed
    law = _time_law(entry.time_law or motion.time_law) if process is None else TimeLaw(kind=TimeLawKind.STEADY)
    return {"process": process, "feed": feed, "time_law": law}


def _blend(corners: CornerChoice) -> float | None:
    """Distance from a corner at which its rounding begins in [m]; None for a stop."""
    return corners.blend_mm.si if isinstance(corners, BlendEntry) else None


def _via_points(via: ViaEntry, model: RobotModel, robot: RobotEntry) -> dict[str, Any]:
    """What a robot passes before and after a task, by field."""
    stated: dict[object, ViaPoint] = {"home": None, "service": _service(robot.service, model)}
    return {
        name: tuple(stated[it] if isinstance(it, str) else configuration_in_si(model, it) for it in points)
        for name, points in (("via_before", via.before), ("via_after", via.after))
    }


def _posture(given: Given, models: Mapping[str, RobotModel], *robots: str) -> Array | None:
    """A configuration of the first of some robots in [rad] or [m]; None when it is not given."""
    return None if given is None else configuration_in_si(models[robots[0]], given)


def _straight_move(distance: Mm, duration: float) -> StraightMove | None:
    """An approach or a retreat; none over no distance."""
    return StraightMove(distance=distance.si, duration=duration) if distance else None


def _axis_numbers(words: Sequence[str]) -> tuple[int, ...]:
    """Components of a twist by number, in its order."""
    return tuple(sorted(COMPONENTS.index(axis) for axis in words))


Direction = str | tuple[float, float, float]


def tool_directions(entry: TaskEntry) -> tuple[Direction | None, Direction]:
    """Tool axis (None for the normal) and tool x of a task, as names or vectors.

    A task that prescribes positions only, on a path that is not projected, needs no axis; the tool then points against
    the normal of the path's plane.
    """
    if entry.tool_axis not in {None, "normal"}:
        return entry.tool_axis, entry.tool_x
    path = entry.path
    is_given = path.project is not None or path.file_key is not None or path.is_on_part
    if path.is_seam or is_given or needs_surface(entry):
        return None, entry.tool_x
    shape = path.circle or path.rectangle or path.rhombus or path.polyline
    normal = PLANE_NORMAL[(shape.plane if shape else None) or "xy"]
    is_default = "tool_x" not in entry.model_fields_set
    return f"-{normal}", "+y" if is_default and normal == "x" else entry.tool_x


def resolved_document(document: CellDocument, *, timed: Collection[str]) -> dict[str, Any]:
    """The file as plain values in its own units, with every default that follows from other entries filled in.

    ``timed`` are the names of the tasks whose path brings its own clock.
    """
    values = document.model_dump(exclude_none=True) | _written_program(document)
    motion = values["motion"]
    for name, task in document.tasks.items():
        entry = values["tasks"][name]
        tool_axis, entry["tool_x"] = tool_directions(task)
        entry["start_s"] = task.begins_s
        entry["tolerance"].setdefault("between_rows_mm", task.tolerance.position_mm)
        entry["tolerance"].setdefault("between_rows_deg", task.tolerance.orientation_deg)
        if task.relative_to == "part":
            entry.setdefault("tool_depth_mm", document.checks.tool_depth_mm)
        if not task.path.is_seam:
            entry["tool_axis"] = "normal" if tool_axis is None else tool_axis
        if name not in timed and not task.path.is_programmed:
            if task.process is None:
                entry.setdefault("time_law", motion["time_law"])
            entry.setdefault("corners", motion["corners"])
        if task.path.is_planar and task.path.project is None:
            path = {"offset_mm": 0.0, **entry["path"]}
            entry["path"] = {key: path[key] for key in fields_of(PathEntry) if key in path}
        values["tasks"][name] = {key: entry[key] for key in TaskEntry.model_fields if key in entry}
    for name, robot in document.robots.items():
        written = with_floor_height(values["robots"][name], robot, document.environment)
        if robot.tool.rod is not None:
            written["tool"] = {key: value for key, value in written["tool"].items() if key not in OF_ROD}
        values["robots"][name] = written
    for grasp in values["part"]["held_by"][:1]:
        del grasp["axes"]  # the first holder has no choice
    return values


def _written_program(document: CellDocument) -> dict[str, Any]:
    """The program as plain values, its marks with their dwells; nothing when the cell has none."""
    if document.program is None:
        return {}
    values = document.program.model_dump(exclude_none=True)
    return {"program": {**values, "marks": tuple(mark.model_dump() for mark in document.program.all_marks)}}


def _time_law(law: str | TrapezoidEntry) -> TimeLaw:
    if isinstance(law, TrapezoidEntry):
        return TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=law.trapezoid.ramp)
    return TimeLaw(kind=TimeLawKind(law))


def build_motion(entry: MotionEntry) -> MotionSettings:
    """Mode, clock, timing, and joints that fail."""
    cycle = entry.timing.cycle_s if isinstance(entry.timing, CycleEntry) else None
    return MotionSettings(
        mode=Mode(entry.mode),
        duration=entry.duration_s,
        step=entry.row_step,
        grid=None if entry.grid_ms is None else entry.grid_ms.si,
        is_leximin=entry.greatest_feeds == "leximin",
        finer=None if entry.row_step == entry.step_s else entry.step_s,
        cyclic=entry.cyclic,
        locked=entry.locked_joints,
        timing=Timing(entry.timing) if isinstance(entry.timing, str) else Timing.CYCLE,
        cycle=cycle,
        build_up=None if isinstance(entry.jerk_build_up_s, str) else entry.jerk_build_up_s,
    )


def build_tool(entry: ToolEntry, read_mesh: MeshReader) -> Tool:
    """A tool; its bodies are named ``tool``, ``tool_2``, …, those of a rod first."""
    rod = None if entry.rod is None else build_rod(entry.rod)
    X_FT = entry.matrix if rod is None else rod.X_FT
    bodies = [] if rod is None else list(rod.bodies())
    if entry.geometry is not None:
        solid, X_FS = tool_solid(entry.geometry, X_FT, read_mesh)
        bodies.append(Body(name="", link=BASE, shape=solid, X_BS=X_FS))
    for body in entry.bodies:
        solid, X_AS = centred_solid(body, read_mesh)
        bodies.append(Body(name="", link=BASE, shape=solid, X_BS=body.at.matrix @ X_AS))
    return Tool(
        X_FT=X_FT,
        bodies=tuple(replace(body, name=tool_body_name(number)) for number, body in enumerate(bodies, start=1)),
        mass=entry.mass_kg,
        centre=None if entry.centre_mm is None else in_si(entry.centre_mm),
        rod=rod,
    )


def build_rod(entry: RodEntry) -> Rod:
    """A rod in [m] and [rad]."""
    holder = entry.holder
    return Rod(
        length=entry.length_mm.si,
        tilt=entry.tilt_deg.si,
        roll=entry.roll_deg.si,
        radius=entry.radius_mm.si,
        stick_out=entry.stick_out_mm.si,
        holder=None if holder is None else Holder(radius=holder.radius_mm.si, length=holder.length_mm.si),
    )
