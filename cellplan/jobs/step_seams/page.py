"""A 3-D page of a STEP part with its edges and seams, numbered as their names: one file that loads nothing."""

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.files.run.whole_file import replace_older
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.jobs.step_seams.listing import Listing, SeamsRequest, seams_record
from cellplan.model.units import MM
from cellplan.report.page.render import template

MARK: Final = "cellplan-seams-page"
KIND: Final = "a page of seams"
POINTS: Final = 65  # of a curve that is drawn
FEWEST: Final = 2


def write_seams_page(listing: Listing, request: SeamsRequest, target: Path) -> int:
    """Write the page, in place of an older one only; its size in bytes."""
    content = seams_page(listing, request).encode()
    target.parent.mkdir(parents=True, exist_ok=True)
    replace_older(target, content, is_of_kind=_is_seams_page, kind=KIND)
    return len(content)


def seams_page(listing: Listing, request: SeamsRequest) -> str:
    """The page as text; equal parts give equal pages."""
    record = seams_record(listing, request)
    mesh = listing.part.mesh
    data: dict[str, Any] = {
        "edges": [
            {**values, "line": _line(edge.line.points), **_middle(edge.line)}
            for values, edge in zip(record["edges"], listing.edges, strict=True)
        ],
        "vertices": np.round(MM * mesh.vertices, 3).ravel().tolist(),
        "triangles": mesh.faces.ravel().tolist(),
    }
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return template("jobs/step_seams/seams.html").render(r=record, mark=MARK, data=text, name=request.path.name)


def _line(points: np.ndarray[Any, Any]) -> list[float]:
    """Points of a curve in [mm], one number after the other; no more than are seen."""
    step = np.unique(np.linspace(0, len(points) - 1, min(len(points), POINTS)).round().astype(int))
    return np.round(MM * points[step], 3).ravel().tolist()


def _middle(line: SeamLine) -> dict[str, list[Any]]:
    """Middle of a line in [mm], unit vector of travel there, and outward normals of its walls."""
    k = (len(line.points) - 1) // 2
    middle = line.points[k] if len(line.points) > FEWEST else line.points.mean(axis=0)
    return {
        "middle": np.round(MM * middle, 3).tolist(),
        "travel": np.round(line.tangents[k], 6).tolist(),
        "normals": [np.round(normals[k], 6).tolist() for normals in line.walls.values()],
    }


def _is_seams_page(path: Path) -> bool:
    """Whether a file is such a page."""
    with path.open("rb") as stream:
        return MARK.encode() in stream.read(1000)
