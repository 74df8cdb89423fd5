"""The 3-D page: one file with its data, its style and its program."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cellplan.model.units import MM
from cellplan.report.page.render import template
from cellplan.report.record.view import ViewRecord

MARK: Final = '<meta name="generator" content="cellplan view">'  # stands in the first lines of every page
MARK_WITHIN: Final = 400  # [bytes]
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


def view_page(record: ViewRecord) -> str:
    """The page as text; it loads nothing and works without a network."""
    return template("view/view.html").render(
        r=record,
        mark=MARK,
        scripts=[f"view/{name}.js" for name in SCRIPTS],
        data=script_json(record),
        about=list(_about(record)),
    )


def unmade_view_page(cell: str, *, cell_file: str) -> str:
    """What stands in a run folder in place of its 3-D page until that is made: the line that makes it.

    Args:
        cell: Name of the cell.
        cell_file: Name of its cell file where that line must name it; empty otherwise.
    """
    return template("view/unmade.html").render(cell=cell, cell_file=cell_file, mark=MARK)


def _about(record: ViewRecord) -> Iterator[str]:
    """How exact the page is."""
    if record["scenes"][0]["visuals"]:
        yield (
            "Robots are drawn by the visual meshes of their files where these have any; distances and collisions are "
            "those of the bodies of the proof, which are drawn where they are marked, or with the visual meshes off."
        )
    else:
        yield "Bodies are those of the proof."
    deviation = max((each.get("deviation", 0.0) for each in record["geometries"]), default=0.0)
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
    if any(each for one in record["scenes"] for each in one["nearest"]["lower_bound"]):
        yield "A distance after ≥ is that of convex hulls, never above the true one."


def script_json(record: ViewRecord) -> str:
    """A record as JSON that no browser takes for markup, wherever it stands in a page."""
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def is_view_page(path: Path) -> bool:
    """Whether a file is a 3-D page that cellplan wrote."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return MARK.encode() in file.read(MARK_WITHIN)
