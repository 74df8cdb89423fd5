"""COLLADA files read into loose triangles by pycollada, after every number of them was held against its declaration.

Why not pycollada alone: it takes what is not a number for 0, stops reading numbers where one is damaged, drops holes
of polygons, takes the first list of triangles for all, and refuses shapes for a missing texture.
"""

from collections.abc import Iterator
from io import BytesIO
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats.collada_tree import Located, read_collada
from cellplan.geometry.mesh.formats.numbers import plain_word
from cellplan.geometry.mesh.formats.polygons import Triangles, cut_polygons
from cellplan.geometry.mesh.formats.strict_xml import printable
from cellplan.geometry.transforms import Array

UPRIGHT: Final = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}  # rotations from the axes right, up and towards the viewer, as the format defines them for each, to x, z and -y
MAX_VISITS: Final = 100_000  # nodes, counted as often as they are instanced
MAX_TRIANGLES: Final = 500_000


def parse_collada(data: bytes, name: str, *, is_upright: bool) -> tuple[Triangles, float]:
    """Vertices in [m] and triangles of all geometries of the scene, and the metres of one unit of the file.

    Args:
        is_upright: Whether the axis that the file calls up becomes z. The links of URDFs are drawn in the frames of
            their links, whatever axis is called up: neither RViz nor pinocchio turns them, and files that are called
            Y_UP agree with the STL drawing of the same link only as they are. The unit is always applied, as by RViz;
            pinocchio leaves it out and takes an arm drawn in inches for one of 40 times its size.

    Raises:
        InputError: With line or name of the element that is damaged or not supported, or when nothing is drawn.
    """
    root = read_collada(data, name)
    meter, turn = _meter(root), _upright(root) if is_upright else np.eye(3)
    pieces: list[Triangles] = []
    count = offset = 0
    for points, flat, sizes, X in _placed(_document(root, name), name):
        side = float(np.linalg.det(X[:3, :3]))
        if side == 0.0:
            raise InputError(f"{name}: expected nodes that keep a volume, got one that is scaled to nothing")
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused by name later
            vertices = meter * (points @ X[:3, :3].T + X[:3, 3]) @ turn.T
        faces = cut_polygons(vertices, flat, sizes, name)
        count, offset = count + len(faces), offset + len(vertices)
        if count > MAX_TRIANGLES or offset > 3 * MAX_TRIANGLES:
            raise InputError(f"{name}: expected at most {MAX_TRIANGLES} triangles, got more")
        pieces.append((vertices, (faces if side > 0.0 else faces[:, ::-1]) + (offset - len(vertices))))
    if not count:
        raise InputError(f"{name}: expected triangles or polygons in the scene, got none")
    return (np.concatenate([piece[0] for piece in pieces]), np.concatenate([piece[1] for piece in pieces])), meter


def _meter(root: Located) -> float:
    """Metres of one unit of the file; one where it does not say."""
    unit = root.find("asset/unit")
    text = "1" if unit is None else unit.get("meter", "1")
    try:
        meter = float(plain_word(text))
    except ValueError:
        meter = 0.0
    if isinstance(unit, Located) and not 0.0 < meter < np.inf:
        raise unit.error(f"expected a positive number in 'meter', got '{printable(text)}'")
    return meter


def _upright(root: Located) -> Array:
    """Rotation that brings the axis that the file calls up onto z; that axis is y where it does not say."""
    element = root.find("asset/up_axis")
    axis = "Y_UP" if element is None else (element.text or "").strip()
    if isinstance(element, Located) and axis not in UPRIGHT:
        raise element.error(f"expected X_UP, Y_UP or Z_UP, got '{printable(axis)}'")
    return UPRIGHT[axis]


def _document(root: Located, name: str) -> Any:
    """The file as pycollada reads it."""
    import collada

    try:
        return collada.Collada(BytesIO(ET.tostring(root)))
    except Exception as error:  # noqa: BLE001 - whatever the library stumbles over, the file is at fault
        reason = printable(" ".join(str(getattr(error, "msg", error)).split()), 100) or type(error).__name__
        raise InputError(f"{name}: expected a COLLADA file that can be read, got a damaged one: {reason}") from None


def _placed(document: Any, name: str) -> Iterator[tuple[Array, NDArray[np.int64], NDArray[np.int64], Array]]:
    """Points, corners of all polygons, the number of corners of each, and the pose, of all that the scene shows."""
    from collada.scene import GeometryNode

    scene = document.scene or (document.scenes[0] if len(document.scenes) == 1 else None)
    if scene is None:
        raise InputError(f"{name}: expected a <scene> that shows a <visual_scene>, got none")
    waiting = [(node, np.eye(4)) for node in reversed(scene.nodes)]
    for _ in range(MAX_VISITS):
        if not waiting:
            return
        node, X = waiting.pop()
        if isinstance(node, GeometryNode):
            for faces in node.geometry.primitives:
                points = np.asarray(faces.vertex, dtype=np.float64)
                corners = np.asarray(faces.vertex_index, dtype=np.int64)
                sizes = getattr(faces, "vcounts", np.full(len(corners), 3))
                yield points, corners.ravel(), np.asarray(sizes, dtype=np.int64), X
        else:
            X_node = X @ np.asarray(node.matrix, dtype=np.float64)
            waiting += [(child, X_node) for child in reversed(node.children)]
    raise InputError(f"{name}: expected at most {MAX_VISITS} nodes in the scene, got more")
