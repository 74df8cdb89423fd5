"""A 3-D page: its record of bodies, joints, paths, motion and what the checks found, and the one file that shows it.

Lengths in the record are in [m] and angles in [rad], as the page computes with them; poses are the upper three rows of
a matrix, row by row. Arrays are little-endian and in base64. Robots, links, bodies and joints are named by their
numbers; -1 is no robot, or the base. Keys whose names do not say all:

- page: ``kind`` is run, cell or study; ``source`` is the cell file, for the command that the page shows, with
  ``settings`` as ``KEY=VALUE``.
- shape: ``box`` edge lengths, ``cylinder`` radius and length, ``capsule`` radius and length of its line, ``sphere``
  radius, ``plane`` nothing: everything below z = 0 is solid. Of a mesh ``low`` is the lowest corner and ``size`` the
  edges of the box that holds it; ``points`` have 16 bit for each coordinate, from 0 at ``low`` to 65535 at its other
  end, ``triangles`` 16 bit for each corner, or 32 of more than 65536 points; ``deviation``: no point that is drawn is
  farther than this from the file's.
- robot: ``base`` is its pose in the world, ``column`` the number of its first joint among those of all robots, ``tip``
  the pose of its tool tip at the reference configuration; the ``axes`` are those there, in the frame of the base; the
  ``scale`` of a joint is its printed value per value in SI units.
- body: ``accuracy`` is how far the real thing may stick out of it; ``replaced`` says that the robot's file draws its
  link otherwise; ``stands`` is the height of the floor or the ceiling of an upright column, ``outline`` the corners of
  one that is cut off along the plane of a base, from above.
- motion: joints move linearly between rows; ``total`` counts those of the program, of which fewer are in the page where
  it is long; ``times`` have 64 bit, ``q`` 32 bit for each joint.
- nearest: ``step`` is the largest time between two samples; ``pairs`` are empty where none is near; ``lower_bound``
  says that the distance is that of convex hulls, never above the true one; ``points`` are in the frames of both bodies.
- certified: ``distances`` are kept all through the block that holds the time; null where none is near.
"""

import json
from base64 import b64encode
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.units import MM
from cellplan.report.page.render import template
from cellplan.report.page.view import MARK
from cellplan.report.record.common import Record

SCHEMA: Final = "cellplan.view/1"
POSE_DECIMALS: Final = 9  # [m]: far below what a picture shows
POINT_DECIMALS: Final = 6  # [m] of paths and nearest points

_SCRIPTS: Final = (
    "algebra kinematics shapes camera webgl painter sight stage traces dom player controls panels bases main start"
)
SCRIPTS: Final = _SCRIPTS.split()  # each after those that it needs

Numbers = list[float]
ViewRecord = Record


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
    return template("jobs/view/page/view.html").render(
        r=record,
        mark=MARK,
        scripts=[f"jobs/view/page/scripts/{name}.js" for name in SCRIPTS],
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
