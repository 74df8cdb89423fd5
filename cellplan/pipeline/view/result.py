"""A 3-D page: its record of bodies, joints, paths, motion and what the checks found, and the one file that shows it.

Lengths in the record are in [m] and angles in [rad], as the page computes with them; poses are the upper three rows of
a matrix, row by row. Arrays are little-endian and in base64.
"""

import json
from base64 import b64encode
from collections.abc import Iterator
from typing import Annotated, Any, Final, TypedDict

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.units import MM
from cellplan.report.page.render import template
from cellplan.report.page.view import MARK

SCHEMA: Final = "cellplan.view/1"
POSE_DECIMALS: Final = 9  # [m]: far below what a picture shows
POINT_DECIMALS: Final = 6  # [m] of paths and nearest points

SCRIPTS: Final = (
    "algebra",
    "kinematics",
    "shapes",
    "camera",
    "webgl",
    "painter",
    "sight",
    "stage",
    "traces",
    "dom",
    "player",
    "controls",
    "panels",
    "bases",
    "main",
)  # each after those that it needs
Numbers = list[float]


class GeometryRecord(TypedDict, total=False):
    """A shape: one of the solids by its dimensions, or a mesh."""

    box: Annotated[Numbers, "edge lengths"]
    cylinder: Annotated[Numbers, "radius and length"]
    capsule: Annotated[Numbers, "radius and length of its line"]
    sphere: Annotated[Numbers, "radius"]
    plane: Annotated[Numbers, "empty: everything below z = 0 is solid"]
    low: Annotated[Numbers, "of a mesh: lowest corner"]
    size: Annotated[Numbers, "of a mesh: edges of the box that holds it"]
    points: Annotated[str, "of a mesh: 16 bit for each coordinate, from 0 at `low` to 65535 at `low` + `size`"]
    triangles: Annotated[str, "of a mesh: 16 bit for each corner, or 32 bit of more than 65536 points"]
    deviation: Annotated[float, "of a mesh: no point that is drawn is farther than this from the file's"]


class JointViewRecord(TypedDict):
    """A driven joint."""

    name: str
    unit: Annotated[str, "`deg` or `mm`"]
    scale: Annotated[float, "printed value per value in SI units"]
    lower: float | None
    upper: float | None
    velocity: float


class AxisRecord(TypedDict):
    """An axis that moves a link, at the configuration where all joints read zero, in the frame of the base."""

    parent: Annotated[int, "number of the link that carries it, -1 for the base"]
    turns: bool
    axis: Numbers
    point: Numbers
    joint: Annotated[int, "number of the joint that drives it"]
    ratio: float
    offset: float


class RobotViewRecord(TypedDict):
    """A robot."""

    name: str
    model: str
    colour: str
    base: Annotated[Numbers, "pose of its base in the world"]
    column: Annotated[int, "number of its first joint among those of all robots"]
    joints: list[JointViewRecord]
    axes: list[AxisRecord]
    tip_link: int
    tip: Annotated[Numbers, "pose of its tool tip at the reference configuration"]


class BodyViewRecord(TypedDict):
    """A body of the proof."""

    name: str
    kind: str
    robot: Annotated[int, "number of the robot that moves it, -1 for none"]
    link: int
    geometry: int
    pose: Numbers
    accuracy: Annotated[float | None, "how far the real thing may stick out of it"]
    replaced: Annotated[bool, "whether the robot's file draws its link otherwise"]
    stands: Annotated[dict[str, float], "of an upright column: height of the `floor` or of the `ceiling`"]
    outline: Annotated[Numbers, "of a column cut off along the plane of a base: its corners seen from above, x and y"]


class VisualRecord(TypedDict):
    """What a robot's file draws of a link."""

    robot: int
    link: int
    geometry: int
    pose: Numbers


class PlaceRecord(TypedDict):
    """What carries the part from an instant on."""

    begin: float
    robot: int
    link: int
    pose: Annotated[Numbers, "of the part frame"]


class TaskViewRecord(TypedDict):
    """A task and its path."""

    name: str
    robot: int
    in_world: bool
    points: Annotated[Numbers, "x, y, z of points along the path, in the part frame or in the world"]


class MotionViewRecord(TypedDict):
    """Joint positions over time; joints move linearly between the rows."""

    count: int
    total: Annotated[int, "rows of the program; fewer are in the page where it is long"]
    times: Annotated[str, "64 bit for each row"]
    q: Annotated[str, "32 bit for each row and joint"]
    phases: Annotated[list[dict[str, Any]], "name, begin and end"]


class NearestRecord(TypedDict):
    """The closest pair at some sample times."""

    step: Annotated[float, "largest time between two of them"]
    required: float
    times: Numbers
    pairs: Annotated[list[list[int]], "two bodies; empty where none is near"]
    distances: Numbers
    lower_bound: Annotated[list[bool], "whether the distance is that of convex hulls, never above the true one"]
    points: Annotated[list[Numbers], "the nearest points, each in the frame of its body"]


class ClearanceCurveRecord(TypedDict):
    """What the report of a run certifies over time; empty where nothing is certified."""

    times: Numbers
    distances: Annotated[list[float | None], "kept all through the block that holds the time; null where none is near"]


class ContactViewRecord(TypedDict):
    """Two bodies that touch for a while."""

    bodies: list[int]
    first: float
    last: float
    allowed: bool
    text: str


class FailureRecord(TypedDict):
    """Something that failed, and where."""

    text: str
    at: float | None
    bodies: list[int]
    joint: Annotated[list[int], "number of the robot and of its joint; empty for none"]


class ExcludedRecord(TypedDict):
    """Pairs that are not checked, or less than others, for one reason."""

    reason: str
    pairs: list[list[int]]


class BaseRecord(TypedDict):
    """The base of a robot as its cell file has it."""

    robot: int
    xyz_mm: Numbers
    rpy_deg: Numbers


class SceneViewRecord(TypedDict):
    """One layout of a cell and its motion."""

    name: str
    facts: Annotated[list[list[str]], "pairs of a label and a value"]
    remarks: list[str]
    passed: bool | None
    robots: list[RobotViewRecord]
    bodies: list[BodyViewRecord]
    visuals: list[VisualRecord]
    part: list[PlaceRecord]
    tasks: list[TaskViewRecord]
    motion: MotionViewRecord
    nearest: NearestRecord
    certified: ClearanceCurveRecord
    contacts: list[ContactViewRecord]
    failures: list[FailureRecord]
    excluded: list[ExcludedRecord]
    bases: Annotated[list[BaseRecord], "of a cell whose bases may be moved; else empty"]


class ViewRecord(TypedDict):
    """A 3-D page."""

    schema: str
    kind: Annotated[str, "`run`, `cell` or `study`"]
    cell: str
    source: Annotated[str, "the cell file, for the command that the page shows"]
    settings: Annotated[list[str], "values that were set in it, as `KEY=VALUE`"]
    geometries: list[GeometryRecord]
    scenes: list[SceneViewRecord]
    caution: str


def pose_numbers(X: Array) -> Numbers:
    """A pose of shape (4, 4) as twelve numbers, row by row."""
    return [number + 0.0 for number in np.round(X[:3], POSE_DECIMALS).ravel().tolist()]


def point_numbers(points: Array) -> Numbers:
    """Points of shape (..., 3) as x, y, z one after the other."""
    return [number + 0.0 for number in np.round(points, POINT_DECIMALS).ravel().tolist()]


def packed(values: np.ndarray[Any, Any], kind: str) -> str:
    """An array in base64, each number as ``kind`` says (``<f4``, ``<u2`` …)."""
    return b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


# Page


def view_page(record: ViewRecord) -> str:
    """The page as text; it loads nothing and works without a network."""
    return template("view/view.html").render(
        r=record,
        mark=MARK,
        scripts=[f"view/{name}.js" for name in SCRIPTS],
        data=script_json(record),
        about=list(_about(record)),
    )


def _about(record: ViewRecord) -> Iterator[str]:
    """How exact the page is."""
    if record["scenes"][0]["visuals"]:
        yield (
            "Robots are drawn by the visual meshes of their files where these have any; distances and collisions are "
            "those of the bodies of the proof, which are drawn where they are marked, or with the visual meshes off."
        )
    else:
        yield "Bodies are those of the proof."
    deviation = max((geometry.get("deviation", 0.0) for geometry in record["geometries"]), default=0.0)
    if deviation > 0.0:
        yield f"Meshes are drawn nowhere farther than {MM * deviation:.2g} mm from their files."
    scene = record["scenes"][0]
    motion, nearest = scene["motion"], scene["nearest"]
    if motion["count"] < motion["total"]:
        yield f"Of {motion['total']} rows {motion['count']} are in the page."
    if motion["count"] > 1:
        step = f"{MM * nearest['step']:.3g} ms"
        yield (
            f"Joints move linearly between rows. The closest pair is computed every {step} or more often; in between "
            "its line joins the same two points."
        )
    if scene["certified"]["times"]:
        yield (
            "The curve over the time line is the distance that the report certifies: each value is kept all through "
            "its block of the motion, between the rows as well."
        )
    elif motion["count"] > 1:
        yield "Nothing is certified here; the curve over the time line is that of the computed distances."
    yield "The closest pair is one of those that are to keep a clearance and move against each other."
    if any(bound for one in record["scenes"] for bound in one["nearest"]["lower_bound"]):
        yield "A distance after ≥ is that of convex hulls, never above the true one."


def script_json(record: ViewRecord) -> str:
    """A record as JSON that no browser takes for markup, wherever it stands in a page."""
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text
