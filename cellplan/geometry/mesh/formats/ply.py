"""PLY mesh files, text and binary, read into loose triangles."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats.numbers import text_numbers
from cellplan.geometry.mesh.formats.polygons import Polygons, Triangles, polygons_as_triangles

TYPES: Final = {
    name: code
    for code, names in {
        "i1": ("char", "int8"),
        "u1": ("uchar", "uint8"),
        "i2": ("short", "int16"),
        "u2": ("ushort", "uint16"),
        "i4": ("int", "int32"),
        "u4": ("uint", "uint32"),
        "f4": ("float", "float32"),
        "f8": ("double", "float64"),
    }.items()
    for name in names
}
ORDERS: Final = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
INDEX_NAMES: Final = ("vertex_indices", "vertex_index")
MAX_ROWS: Final = 1_500_000  # the largest allowed mesh with three vertices of its own for each triangle
MAX_LISTS: Final = 500_000  # rows with lists: one for each triangle of the largest allowed mesh
MAX_INDEX: Final = 2**31  # beyond any index that such a file can hold
MAX_CORNERS: Final = 1000  # more in one face is a damaged file


@dataclass(frozen=True, slots=True)
class _Property:
    """One column of an element; ``count`` is the type of the length of a list, None for a plain number."""

    name: str
    kind: str
    count: str | None


@dataclass(slots=True)
class _Element:
    """A table in the file: name, number of rows, columns."""

    name: str
    rows: int
    properties: list[_Property]

    def column(self, names: tuple[str, ...]) -> int | None:
        """Place of the first column of one of these names."""
        return next((i for i, prop in enumerate(self.properties) if prop.name in names), None)


class _Values:
    """The numbers behind the header, taken one after the other; text and binary have the same interface."""

    def __init__(self, body: bytes, order: str) -> None:
        """Take the bytes after the header; ``order`` is the byte order, empty for text."""
        self._order = order
        self._body = body
        self.place = 0
        self._words = text_numbers(body) if not order else np.zeros(0)

    def take(self, kind: str, count: int) -> NDArray[np.float64]:
        """The next ``count`` numbers of one type."""
        if not self._order:
            values = self._words[self.place : self.place + count]
            self.place += count
        else:
            dtype = np.dtype(self._order + TYPES[kind])
            values = np.frombuffer(self._body, dtype=dtype, count=count, offset=self.place).astype(np.float64)
            self.place += count * dtype.itemsize
        if len(values) != count:
            raise ValueError("unexpected end of the file")
        return values

    def take_table(self, element: _Element) -> NDArray[np.float64]:
        """All rows of an element that has no lists, shape (rows, columns)."""
        width = len(element.properties)
        if not self._order:
            return self.take("", element.rows * width).reshape(-1, width)
        dtype = np.dtype([(f"c{i}", self._order + TYPES[prop.kind]) for i, prop in enumerate(element.properties)])
        table = np.frombuffer(self._body, dtype=dtype, count=element.rows, offset=self.place)
        self.place += table.nbytes
        return np.stack([table[f"c{i}"].astype(np.float64) for i in range(width)], axis=1)

    @property
    def is_used_up(self) -> bool:
        """Whether nothing but blanks is left."""
        return self.place == len(self._words) if not self._order else not self._body[self.place :].strip(b"\r\n\0 ")


def parse_ply(data: bytes, name: str) -> Triangles:
    """Vertices and triangles of a PLY file; columns other than x, y, z and the corner lists are passed over."""
    order, elements, body = _header(data, name)
    vertices: NDArray[np.float64] | None = None
    polygons: Polygons | None = None
    try:
        values = _Values(body, order)
        for element in elements:
            columns = [element.column((axis,)) for axis in "xyz"]
            if element.name == "vertex" and None not in columns and not _has_lists(element):
                vertices = values.take_table(element)[:, [column for column in columns if column is not None]]
            elif element.name == "face" and element.column(INDEX_NAMES) is not None:
                polygons = _polygons(values, element)
            elif _has_lists(element):
                list(_rows(values, element))
            else:
                values.take_table(element)
    except ValueError as error:
        raise InputError(
            f"{name}: expected the numbers that the PLY header declares, got a damaged file: {error}"
        ) from None
    if vertices is None or polygons is None:
        raise InputError(f"{name}: expected a PLY file with elements 'vertex' (x, y, z) and 'face' (vertex_indices)")
    if not values.is_used_up:
        raise InputError(
            f"{name}: expected the end of the file after the numbers that the PLY header declares, got more"
        )
    return polygons_as_triangles(vertices, polygons, name)


def _header(data: bytes, name: str) -> tuple[str, list[_Element], bytes]:
    """Byte order, elements and the bytes after the header."""
    head, mark, body = data.partition(b"end_header")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    if not mark or not lines or lines[0] != ["ply"]:
        raise InputError(f"{name}: expected a PLY file that starts with 'ply' and has an 'end_header'")
    order: str | None = None
    elements: list[_Element] = []
    for line, words in enumerate(lines[1:], start=2):
        try:
            order = _header_line(words, elements) or order
        except (KeyError, ValueError, IndexError):
            shown = " ".join(words)[:60]
            raise InputError(f"{name}:{line}: expected a PLY header line, got '{shown}'") from None
    if order is None:
        raise InputError(f"{name}: expected a PLY header with a 'format' line")
    for element in elements:
        most = MAX_LISTS if _has_lists(element) else MAX_ROWS
        if element.rows > most:
            raise InputError(f"{name}: expected at most {most} rows of '{element.name}', got {element.rows}")
    return ORDERS[order], elements, body[2:] if body.startswith(b"\r\n") else body[1:]


def _header_line(words: list[str], elements: list[_Element]) -> str | None:
    """Take in one line of the header; the name of the format when it is that line."""
    match words:
        case [] | ["comment" | "obj_info", *_]:
            pass
        case ["format", order, "1.0"] if order in ORDERS:
            return order
        case ["element", name, rows] if int(rows) >= 0:
            elements.append(_Element(name, int(rows), []))
        case ["property", "list", count, kind, name] if TYPES[count][0] != "f" and kind in TYPES:
            elements[-1].properties.append(_Property(name, kind, count))
        case ["property", kind, name] if kind in TYPES:
            elements[-1].properties.append(_Property(name, kind, None))
        case _:
            raise ValueError("not a line of a PLY header")
    return None


def _has_lists(element: _Element) -> bool:
    """Whether the rows may differ in length."""
    return any(prop.count for prop in element.properties)


def _triangles(values: _Values, element: _Element) -> NDArray[np.float64] | None:
    """Corner indices of all faces at once if every one has three, shape (M, 3); else None and nothing taken."""
    column = element.column(INDEX_NAMES) or 0
    corners = element.properties[column]
    others = [prop for prop in element.properties if prop is not corners]
    if corners.count is None or any(prop.count for prop in others):
        return None
    count = _Property("count", corners.count, None)
    unrolled = [count, *[_Property(corners.name, corners.kind, None)] * 3]
    flat = [*element.properties[:column], *unrolled, *element.properties[column + 1 :]]
    start = values.place
    try:
        table = values.take_table(_Element(element.name, element.rows, flat))
    except ValueError:
        table = np.zeros((1, len(flat)))
    if np.all(table[:, column] == 3.0):
        return table[:, column + 1 : column + 4]
    values.place = start
    return None


def _polygons(values: _Values, element: _Element) -> Polygons:
    """Corner indices of each face."""
    column = element.column(INDEX_NAMES) or 0
    triangles = _triangles(values, element)
    faces = list(triangles) if triangles is not None else [row[column] for row in _rows(values, element)]
    numbers = np.concatenate([np.zeros(0), *faces])
    is_whole = np.all((np.abs(numbers) < MAX_INDEX) & (numbers == np.floor(numbers)))
    if not is_whole or min(map(len, faces), default=3) < 3:
        raise ValueError("a face needs three or more whole vertex numbers")
    return [face.astype(np.int64).tolist() for face in faces]


def _rows(values: _Values, element: _Element) -> Iterator[list[NDArray[np.float64]]]:
    """Columns of each row of an element with lists."""
    for _ in range(element.rows):
        row = []
        for prop in element.properties:
            length = 1.0 if prop.count is None else values.take(prop.count, 1)[0]
            if not (0.0 <= length <= MAX_CORNERS and length == np.floor(length)):
                raise ValueError(f"a list has {length:g} entries")
            row.append(values.take(prop.kind, int(length)))
        yield row
