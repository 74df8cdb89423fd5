"""COLLADA text as a tree of those elements that make a shape, each with its line; damage is refused by its line.

Colours, textures, cameras and animations are left out before anything interprets them: what is wrong with them is no
fault of the shape.
"""

from collections.abc import Sequence
from typing import Final
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats.numbers import text_numbers
from cellplan.geometry.mesh.formats.strict_xml import parse_strictly, printable

NAMESPACE: Final = "http://www.collada.org/2005/11/COLLADASchema"
FACES: Final = {"triangles": 3, "tristrips": None, "trifans": None, "polygons": None, "polylist": None}
TRANSFORMS: Final = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3}  # and how many numbers each has
TARGETS: Final = {
    "geometry": "library_geometries/geometry[mesh]",
    "node": ".//node[@id]",
    "visual_scene": "library_visual_scenes/visual_scene[@id]",
}  # what an element instance_… may refer to
UNSUPPORTED: Final = frozenset({"ph", "skew", "lookat", "instance_controller"})  # shapes that would be lost or wrong
TEXTS: Final = frozenset({"up_axis", "float_array", "p", "vcount", *TRANSFORMS})
MESHES: Final = {"geometry", "mesh", "source", "technique_common", "accessor", "param", "vertices", "input", *FACES}
NODES: Final = {"node", "instance_geometry", "instance_node", "visual_scene", "scene", "instance_visual_scene"}
LIBRARIES: Final = {"library_geometries", "library_nodes", "library_visual_scenes"}
KNOWN_ELEMENTS: Final = frozenset({"asset", "unit"} | LIBRARIES | MESHES | NODES | TEXTS | UNSUPPORTED)
MAX_DEPTH: Final = 64  # nesting of elements; drawings have some ten levels of nodes
MAX_ELEMENTS: Final = 600_000  # one for each polygon of the largest allowed mesh, and the others
MAX_STRIDE: Final = 32  # indices of one corner: vertex, normal, colours and textures


class Located(ET.Element):
    """One element that knows its line and the file that it stands in."""

    file: str
    line: int

    def error(self, what: str) -> InputError:
        """Finding about this element, with its line."""
        name = self.get("id") or self.get("name")
        named = f"<{self.tag}>" if name is None else f"<{self.tag}> '{printable(name)}'"
        return InputError(f"{self.file}:{self.line}: {named}: {what}")

    def number(self, key: str, default: int | None = None) -> int:
        """A whole number of an attribute; the default stands for a missing one."""
        text = self.get(key)
        if text is None and default is not None:
            return default
        if text is None or not (text.strip().isascii() and text.strip().isdigit()) or len(text) > 12:
            raise self.error(f"expected a whole number in '{key}', got '{printable(text or '')}'")
        return int(text)

    def numbers(self) -> NDArray[np.float64]:
        """The finite numbers of its text."""
        try:
            values = text_numbers((self.text or "").encode("ascii", errors="strict"))
        except ValueError as error:
            raise self.error(f"expected numbers, got {printable(' '.join(str(error).split()), 80)}") from None
        if not np.all(np.isfinite(values)):
            raise self.error(f"expected finite numbers, got {int(np.sum(~np.isfinite(values)))} others")
        return values

    def indices(self) -> NDArray[np.int64]:
        """The whole numbers from zero of its text."""
        values = self.numbers()
        if np.any((values < 0) | (values != np.floor(values)) | (values > 2**31 - 1)):
            raise self.error("expected whole numbers from 0")
        return values.astype(np.int64)


def read_collada(data: bytes, file: str) -> Located:
    """Root of a COLLADA file whose numbers are whole: as many as it declares, finite, each index within its source."""
    root = _Reader(file).parse(data)
    if root.tag != "COLLADA":
        raise root.error("expected a COLLADA file with <COLLADA> as its root element")
    for element in root.iter():
        if element.tag in UNSUPPORTED:
            raise _located(element).error("not supported: export rigid polygons without holes, placed by matrices")
        if element.tag in TRANSFORMS:
            _check_transform(_located(element))
    seen: set[str] = set()
    for geometry in _all(root, "library_geometries/geometry"):
        name = geometry.get("id", "")
        if not name or name in seen:
            raise geometry.error("expected an id of its own")
        seen.add(name)
        for mesh in _all(geometry, "mesh"):
            _reduce_mesh(mesh)
    _check_references(root)
    root.set("xmlns", NAMESPACE)
    return root


def _all(element: ET.Element, path: str) -> Sequence[Located]:
    """Elements at a path below another."""
    return [_located(child) for child in element.iterfind(path)]


def _one(element: Located, path: str) -> Located:
    """The only element at a path below another."""
    elements = _all(element, path)
    if len(elements) != 1:
        raise element.error(f"expected one <{path.rpartition('/')[2]}>, got {len(elements)}")
    return elements[0]


def _located(element: ET.Element) -> Located:
    """The element, as every element of such a tree is."""
    if not isinstance(element, Located):
        raise TypeError("an element without a line")
    return element


def _check_references(root: Located) -> None:
    """Whatever is instanced stands in this file."""
    for tag, path in TARGETS.items():
        known = {f"#{target.get('id')}" for target in root.iterfind(path)}
        for link in _all(root, f".//instance_{tag}"):
            if link.get("url", "") not in known:
                text = printable(link.get("url", ""))
                what = f"<{tag}> with a <mesh>" if tag == "geometry" else f"<{tag}>"
                raise link.error(f"expected the url of a {what} of this file, got '{text}'")


def _check_transform(element: Located) -> None:
    """A transformation of a node: as many numbers as it needs, and an affine one."""
    values = element.numbers()
    if len(values) != TRANSFORMS[element.tag]:
        raise element.error(f"expected {TRANSFORMS[element.tag]} numbers, got {len(values)}")
    if element.tag == "matrix" and not np.array_equal(values[12:], (0.0, 0.0, 0.0, 1.0)):
        raise element.error(f"expected 0 0 0 1 as the last row, got {' '.join(f'{value:g}' for value in values[12:])}")
    if element.tag == "scale" and not np.all(values):
        raise element.error("expected a scale that keeps a volume, got one of zero")


def _reduce_mesh(mesh: Located) -> None:
    """Leave the positions of a mesh and its faces, checked; other inputs of a corner keep their places only."""
    faces = [child for tag in FACES for child in _all(mesh, tag)]
    vertices = _all(mesh, "vertices")
    inputs = [entry for place in vertices for entry in _all(place, "input") if entry.get("semantic") == "POSITION"]
    if not faces and not inputs:
        return
    if len(vertices) != 1 or len(inputs) != 1:
        raise mesh.error(f"expected one <vertices> with one input POSITION, got {len(vertices)} and {len(inputs)}")
    positions = inputs[0].get("source", "")
    sources = [source for source in _all(mesh, "source") if f"#{source.get('id')}" == positions]
    if len(sources) != 1:
        raise inputs[0].error(f"expected a source of positions, got {len(sources)} named '{printable(positions)}'")
    for other in [child for child in mesh if child.tag == "source" and child is not sources[0]]:
        mesh.remove(other)
    for entry in _all(vertices[0], "input"):
        if entry is not inputs[0]:
            vertices[0].remove(entry)
    count = _positions(sources[0])
    for face in faces:
        column, stride = _reduce_inputs(face, f"#{vertices[0].get('id')}", positions)
        if not _check_faces(face, column=column, stride=stride, positions=count):
            mesh.remove(face)


def _positions(source: Located) -> int:
    """Number of points in a source of three coordinates each."""
    array, accessor = _one(source, "float_array"), _one(source, "technique_common/accessor")
    declared, actual = array.number("count"), len(array.numbers())
    if declared != actual:
        raise array.error(f"expected {declared} numbers as its count declares, got {actual}: is the file truncated?")
    stride, columns = accessor.number("stride", 1), len(accessor)
    if (stride, columns, accessor.number("offset", 0)) != (3, 3, 0) or 3 * accessor.number("count") != actual:
        raise accessor.error(f"expected {actual / 3:g} points of three coordinates each without further numbers")
    return actual // 3


def _reduce_inputs(faces: Located, vertices: str, positions: str) -> tuple[int, int]:
    """Place of the vertex among the indices of a corner, and how many there are."""
    inputs = _all(faces, "input")
    places = [entry.number("offset") for entry in inputs]
    named = [k for k, entry in enumerate(inputs) if entry.get("semantic") == "VERTEX"]
    if len(named) != 1 or inputs[named[0]].get("source") != vertices:
        raise faces.error(f"expected one input VERTEX from '{printable(vertices)}', got {len(named)}")
    if max(places) >= MAX_STRIDE:
        raise faces.error(f"expected offsets below {MAX_STRIDE}, got {max(places)}")
    for entry in inputs:
        if entry is not inputs[named[0]]:
            entry.attrib = {"semantic": "COLOR", "offset": entry.get("offset", ""), "source": positions}
    return places[named[0]], max(places) + 1


def _check_faces(faces: Located, *, column: int, stride: int, positions: int) -> int:
    """Number of faces, after their indices are held against it, against their inputs and the number of points."""
    lists, declared = _all(faces, "p"), faces.number("count")
    indices = [entry.indices() for entry in lists]
    sizes = np.array([len(index) for index in indices], dtype=np.int64)
    if faces.tag == "polylist":
        corners = _one(faces, "vcount").indices()
        actual, is_whole = len(corners), len(lists) == 1 and int(sizes.sum()) == stride * int(corners.sum())
        is_whole = is_whole and bool(np.all(corners > 0))
    elif faces.tag == "triangles":
        actual = int(sizes.sum()) // (3 * stride)
        is_whole = len(lists) <= 1 and int(sizes.sum()) == 3 * stride * actual
    else:
        actual, is_whole = len(lists), bool(np.all((sizes % stride == 0) & (sizes >= 3 * stride)))
    if actual != declared or not is_whole:
        raise faces.error(
            f"expected {declared} as its count declares, with {stride} indices at each corner, got {actual} in "
            f"{int(sizes.sum())} indices: is the file truncated?"
        )
    highest = max((int(index[column::stride].max(initial=-1)) for index in indices), default=-1)
    if highest >= positions:
        raise faces.error(f"expected corners among {positions} points, got point {highest} counted from 0")
    return actual


class _Reader:
    """Puts elements together while expat reads them."""

    def __init__(self, file: str) -> None:
        """Start with no element open."""
        self._file = file
        self._open: list[Located] = []
        self._texts: list[str] = []
        self._root: Located | None = None
        self._skipped, self._count = 0, 0  # levels below an element that is left out, and elements kept
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text

    def parse(self, data: bytes) -> Located:
        """Root element of the bytes."""
        parse_strictly(self._parser, data, self._file)
        if self._root is None:
            raise InputError(f"{self._file}: expected an XML file with a root element")
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        """An element opens; those that make no shape are left out with all below them."""
        is_known = tag in KNOWN_ELEMENTS and (tag != "asset" or len(self._open) == 1)
        if self._skipped or (self._open and not is_known):
            self._skipped += 1
            return
        element = Located(tag, attributes)
        element.file, element.line = self._file, self._parser.CurrentLineNumber
        self._count += 1
        if self._count > MAX_ELEMENTS or len(self._open) >= MAX_DEPTH:
            raise element.error(f"expected at most {MAX_ELEMENTS} elements in {MAX_DEPTH} levels, got more")
        if self._open:
            self._open[-1].append(element)
        else:
            self._root = element
        self._open.append(element)
        self._texts.clear()

    def _end(self, _tag: str) -> None:
        """An element closes."""
        if self._skipped:
            self._skipped -= 1
            return
        element = self._open.pop()
        if element.tag in TEXTS:
            element.text = "".join(self._texts)
        self._texts.clear()

    def _text(self, text: str) -> None:
        """Text of the innermost element."""
        if not self._skipped and self._open and self._open[-1].tag in TEXTS:
            self._texts.append(text)
