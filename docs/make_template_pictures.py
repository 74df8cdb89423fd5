"""Draw the templates of ``cellplan init``: ``python docs/make_template_pictures.py [NAME ...]``.

Writes one picture each into ``docs/images/templates``, by the painter of ``make_cell_picture.py``. The same cells give
the same pictures.
"""

import sys
from pathlib import Path
from typing import Final

import numpy as np
from make_cell_picture import LENS, Surface, View, axes_of, picture_of, pieces_of, surface_of

from cellplan import load_cell, solve
from cellplan.files.templates import TEMPLATES, template_named
from cellplan.geometry.transforms import Array

ROOT: Final = Path(__file__).resolve().parent.parent
FOLDER: Final = ROOT / "docs" / "images" / "templates"
WIDTH, HEIGHT = 640, 400  # [pixels]
COLOURS: Final = 96  # of a picture, to keep the file small
FROM: Final = np.array([0.50, -0.72, 0.48])  # direction from the cell to the viewer
FROM_ELSEWHERE: Final = {
    "two-robots": np.array([0.60, -0.66, 0.42]),
    "own-urdf": np.array([0.30, -0.86, 0.40]),
    "fixed-part": np.array([0.90, -0.12, 0.46]),
    "load-sharing": np.array([0.62, -0.55, 0.56]),
    "rail": np.array([0.72, -0.50, 0.48]),
    "gripper": np.array([0.85, 0.32, 0.42]),
}
SHOWN: Final = 0.94  # of the picture that the cell fills
SHARE: Final = 0.4  # of the program after which it is drawn


def view_of(surface: Surface, direction: Array) -> View:
    """A view from a direction, from as near as the whole cell is seen, with the cell in the middle."""
    points = surface.corners.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    target, reach = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    view = _nearest(points, target, direction / np.linalg.norm(direction), reach)
    for _ in range(4):
        axes = axes_of(view)
        seen = (points - view.eye) @ axes.T
        across = seen[:, :2] / seen[:, 2:]
        middle = 0.5 * (across.min(axis=0) + across.max(axis=0)) * np.linalg.norm(view.eye - view.target)
        target = view.target + middle @ axes[:2]
        view = _nearest(points, target, direction / np.linalg.norm(direction), reach)
    return view


def _nearest(points: Array, target: Array, direction: Array, reach: float) -> View:
    """The nearest view of a point from which all others are seen."""
    near, far = 0.5 * reach, 40.0 * reach
    for _ in range(40):
        middle = 0.5 * (near + far)
        is_seen = _holds(_at(target + middle * direction, target, reach), points)
        near, far = (near, middle) if is_seen else (middle, far)
    return _at(target + far * direction, target, reach)


def _at(eye: Array, target: Array, reach: float) -> View:
    """A view whose floor vanishes beyond the cell."""
    return View(eye=eye, target=target, width=WIDTH, height=HEIGHT, reach=1.15 * reach, fade=(0.9 * reach, 1.7 * reach))


def _holds(view: View, points: Array) -> bool:
    """Whether all points are seen."""
    seen = (points - view.eye) @ axes_of(view).T
    if (seen[:, 2] <= 0.1).any():
        return False
    across = LENS * np.abs(seen[:, :2]) / seen[:, 2:]
    return bool((across < (SHOWN, SHOWN * HEIGHT / WIDTH)).all())


def draw(name: str) -> None:
    """Solve the cell of a template and draw it."""
    solution = solve(load_cell(ROOT / "cells" / template_named(name).source))
    instant = SHARE * float(solution.runs[0].motion.times[-1])
    surface = surface_of(pieces_of(solution, instant))
    picture = picture_of(solution, view_of(surface, FROM_ELSEWHERE.get(name, FROM)), instant)
    FOLDER.mkdir(parents=True, exist_ok=True)
    picture.quantize(COLOURS, dither=0).save(FOLDER / f"{name}.png", optimize=True)


def main() -> None:
    """Draw the templates that are named, or all."""
    for name in sys.argv[1:] or [template.name for template in TEMPLATES]:
        draw(name)


if __name__ == "__main__":
    main()
