"""Mesh files read byte by byte into loose triangles: STL (binary and text) and OBJ; damage is an error, never a gap."""

import re
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.mesh_ply import parse_ply
from cellplan.geometry.mesh_polygons import Polygons, Triangles, fan

STL_HEADER: Final = 84  # [bytes] 80 of comment and 4 of count
STL_TRIANGLE: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_WORDS: Final = frozenset({b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid"})
OBJ_SILENT: Final = frozenset({"vt", "vn", "g", "o", "s", "l", "p", "usemtl", "mtllib"})
FORMATS: Final = ("stl", "obj", "ply")


def parse_mesh(data: bytes, name: str) -> Triangles:
    """Vertices, shape (V, 3), and triangles, shape (M, 3), of a mesh file in its own unit.

    The suffix of the name tells the format.

    Raises:
        InputError: The format is not read, or the file is damaged.
    """
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused by name later
        match name.lower().rpartition(".")[2]:
            case "stl":
                return _parse_stl(data, name)
            case "obj":
                return _parse_obj(data, name)
            case "ply":
                return parse_ply(data, name)
            case "dae":
                raise InputError(f"{name}: COLLADA files are not read: convert the mesh to STL, OBJ or PLY")
            case suffix:
                raise InputError(f"{name}: expected a mesh file .stl, .obj or .ply, got '.{suffix}'")


def _parse_stl(data: bytes, name: str) -> Triangles:
    """Tell binary from text by the length: many binary files also start with the word ``solid``."""
    count = int.from_bytes(data[80:STL_HEADER], "little")
    expected = STL_HEADER + STL_TRIANGLE.itemsize * count
    if len(data) >= STL_HEADER and len(data) == expected:
        corners = np.frombuffer(data, dtype=STL_TRIANGLE, offset=STL_HEADER)["corners"].astype(np.float64)
        return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    if re.match(rb"\s*solid\b", data, re.IGNORECASE) and b"\0" not in data:
        return _parse_text_stl(data, name)
    if len(data) < STL_HEADER:
        raise InputError(f"{name}: expected an STL file, got {len(data)} bytes that are neither binary nor text STL")
    raise InputError(
        f"{name}: expected {expected} bytes for the {count} triangles that its header names, "
        f"got {len(data)}: the file is damaged or not STL"
    )


def _parse_text_stl(data: bytes, name: str) -> Triangles:
    """Text STL: keywords counted apart from the numbers, so that a torn file cannot pass as a small one."""
    tally = dict.fromkeys(STL_WORDS, 0)
    numbers: list[float] = []
    for line, text in enumerate(data.lower().splitlines(), start=1):
        words = text.split()
        if not words:
            continue
        if words[0] not in STL_WORDS:
            raise InputError(f"{name}:{line}: expected a line of a text STL, got '{_shown(words[0])}'")
        tally[words[0]] += 1
        if words[0] == b"vertex":
            numbers.extend(_numbers((word.decode("latin-1") for word in words[1:]), count=3, place=f"{name}:{line}"))
    facets = tally[b"facet"]
    whole = tally[b"outer"] == tally[b"endloop"] == tally[b"endfacet"] == facets and tally[b"vertex"] == 3 * facets
    if not whole or tally[b"solid"] != tally[b"endsolid"]:
        raise InputError(
            f"{name}: expected three vertices in each of {facets} facets and an 'endsolid', got {tally[b'vertex']} "
            f"vertices, {tally[b'endfacet']} 'endfacet' and {tally[b'endsolid']} 'endsolid': the file is cut off"
        )
    return np.array(numbers).reshape(-1, 3), np.arange(3 * facets).reshape(-1, 3)


def _parse_obj(data: bytes, name: str) -> Triangles:
    """Wavefront OBJ: vertices and polygons; material files are not opened, curved surfaces and includes refused."""
    vertices: list[Sequence[float]] = []
    polygons: Polygons = []
    text = data.decode("utf-8", errors="replace")
    if "\0" in text:
        raise InputError(f"{name}: expected an OBJ text file, got binary data")
    for line, words in _obj_lines(text):
        place = f"{name}:{line}"
        if words[0] == "v":
            vertices.append(_obj_vertex(words[1:], place))
        elif words[0] == "f":
            polygons.append([_obj_index(word, known=len(vertices), place=place) for word in words[1:]])
            if len(words) < 4:
                raise InputError(f"{place}: expected a face with at least three corners, got {len(words) - 1}")
        elif words[0] not in OBJ_SILENT:
            raise InputError(f"{place}: expected vertices and flat faces, got '{words[0]}', which is not supported")
    return fan(np.array(vertices, dtype=float).reshape(-1, 3), polygons, name)


def _obj_lines(text: str) -> Iterable[tuple[int, list[str]]]:
    """Words of each line that is not empty, comments cut off and continued lines joined."""
    waiting: list[str] = []
    for line, content in enumerate(text.split("\n"), start=1):
        plain = content.partition("#")[0].rstrip()
        waiting.extend(plain.removesuffix("\\").split())
        if not plain.endswith("\\") and waiting:
            yield line, waiting
            waiting = []


def _obj_vertex(words: list[str], place: str) -> list[float]:
    """Three coordinates; a weight other than one and anything but three colours are refused."""
    numbers = _numbers(words, count=len(words), place=place)
    if len(numbers) not in (3, 4, 6) or (len(numbers) == 4 and numbers[3] != 1.0):
        raise InputError(f"{place}: expected a vertex of three numbers, got '{' '.join(words)[:60]}'")
    return numbers[:3]


def _obj_index(word: str, *, known: int, place: str) -> int:
    """Zero-based vertex of a corner ``v``, ``v/vt``, ``v/vt/vn`` or ``v//vn``; negative ones count from the end."""
    try:
        number = int(word.partition("/")[0])
    except ValueError:
        raise InputError(f"{place}: expected a vertex number, got '{word[:40]}'") from None
    if number == 0 or number < -known:
        raise InputError(f"{place}: expected a vertex number from 1 to {known}, got {number}")
    return number - 1 if number > 0 else known + number


def _numbers(words: Iterable[str], *, count: int, place: str) -> list[float]:
    """Exactly ``count`` numbers."""
    given = list(words)
    try:
        numbers = [float(word) for word in given]
    except ValueError:
        numbers = []
    if len(numbers) != count or len(given) != count:
        raise InputError(f"{place}: expected {count} numbers, got '{' '.join(given)[:60]}'")
    return numbers


def _shown(word: bytes) -> str:
    """A word from a foreign file that is safe to print."""
    return word[:40].decode("ascii", errors="replace").encode("ascii", errors="backslashreplace").decode()
