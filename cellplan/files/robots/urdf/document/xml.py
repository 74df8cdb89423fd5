"""URDF text as a tree of elements that know their line, and the typed reading of their attributes."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.parsers import expat

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.files import read_regular_file
from cellplan.files.input.findings import shown
from cellplan.geometry.mesh.formats.numbers import plain_word
from cellplan.geometry.mesh.formats.strict_xml import parse_strictly
from cellplan.geometry.transforms import Array, pose, pose_from, quaternion_to_rotation

MAX_BYTES: Final = 5_000_000
MAX_DEPTH: Final = 64  # nesting of elements: a URDF needs seven
MAX_TURN: Final = 4.0 * np.pi  # [rad] larger angles of a frame are a wrong unit
UNIT_TOL: Final = 1e-3  # [-] of the length of a quaternion: numbers of four digits
MAX_OFFSET: Final = 20.0  # [m] longer steps between frames are a wrong unit


@dataclass(slots=True)
class Element:
    """One element of the file."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    children: list["Element"] = field(default_factory=list)

    def error(self, what: str) -> InputError:
        """Finding about this element, with its line."""
        return InputError(f"{self.file}:{self.line}: {what}")

    def all(self, *tags: str) -> list["Element"]:
        """Children with one of these tags."""
        return [child for child in self.children if child.tag in tags]

    def one(self, tag: str, owner: str) -> "Element | None":
        """The child with this tag, if there is one; two are refused."""
        elements = self.all(tag)
        if len(elements) > 1:
            raise elements[1].error(f"{owner}: expected one <{tag}>, got {len(elements)}")
        return elements[0] if elements else None

    def text(self, name: str, owner: str) -> str:
        """An attribute that must be there and not be empty."""
        value = self.attributes.get(name, "").strip()
        if not value:
            raise self.error(f"{owner}: expected <{self.tag}> with the attribute '{name}'")
        return value

    def numbers(self, name: str, count: int, *, owner: str, default: Iterable[float] | None = None) -> Array:
        """An attribute of ``count`` finite numbers; the default stands for a missing one, if there is a default."""
        if name not in self.attributes and default is not None:
            return np.array(list(default), dtype=float)
        text = self.text(name, owner)
        try:
            values = np.array([float(plain_word(word)) for word in text.split()])
        except ValueError:
            values = np.empty(0)
        if len(values) != count or not np.all(np.isfinite(values)):
            desired = "a finite number" if count == 1 else f"{count} finite numbers"
            raise self.error(f"{owner}: expected {desired} in '{name}', got {shown(text)}")
        return values

    def number(self, name: str, owner: str, *, default: float | None = None) -> float:
        """An attribute that is one finite number."""
        return float(self.numbers(name, 1, owner=owner, default=None if default is None else [default])[0])

    def walk(self, skipped: frozenset[str]) -> Iterator["Element"]:
        """This element and all below it, but nothing below the skipped tags."""
        yield self
        for child in self.children:
            if child.tag not in skipped:
                yield from child.walk(skipped)


def read_xml(path: Path) -> Element:
    """Read the root element of an XML file without document type, entities or anything else that reaches out.

    Raises:
        InputError: The file cannot be read, is too large, is not well-formed or declares a document type.
    """
    return parse_xml(read_regular_file(path, file=path.name, limit=MAX_BYTES), path.name)


def parse_xml(data: bytes, file: str) -> Element:
    """The same of the bytes of a file.

    Raises:
        InputError: They are not well-formed or declare a document type.
    """
    return _Builder(file).parse(data)


def origin_of(element: Element, owner: str) -> Array:
    """Pose of an element's ``<origin>`` in the frame it is written in; the identity when there is none."""
    origin = element.one("origin", owner)
    if origin is None:
        return np.eye(4)
    xyz = origin.numbers("xyz", 3, owner=owner, default=(0.0, 0.0, 0.0))
    if np.linalg.norm(xyz) > MAX_OFFSET:
        far = float(np.linalg.norm(xyz))
        raise origin.error(f"{owner}: expected an origin within {MAX_OFFSET:g} m, got {far:.6g} m: is the unit mm?")
    if "quat_xyzw" in origin.attributes:
        return pose_from(_rotation_of(origin, owner), xyz)
    rpy = origin.numbers("rpy", 3, owner=owner, default=(0.0, 0.0, 0.0))
    if np.max(np.abs(rpy)) > MAX_TURN:
        most = f"angles of at most two turns ({MAX_TURN:.4g} rad)"
        raise origin.error(f"{owner}: expected {most}, got {shown(origin.attributes['rpy'])}: is the unit deg?")
    return pose(xyz, rpy)


def _rotation_of(origin: Element, owner: str) -> Array:
    """Orientation that a quaternion of URDF 1.1 states, x y z w."""
    if "rpy" in origin.attributes:
        raise origin.error(f"{owner}: expected either 'rpy' or 'quat_xyzw' in <origin>, got both")
    quaternion = origin.numbers("quat_xyzw", 4, owner=owner)
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1.0) > UNIT_TOL:
        raise origin.error(f"{owner}: expected 'quat_xyzw' of length 1, got one of length {length:.6g}")
    return quaternion_to_rotation(np.roll(quaternion, 1))


class _Builder:
    """Puts elements together while expat reads them."""

    def __init__(self, file: str) -> None:
        """Start with no element open."""
        self._file = file
        self._open: list[Element] = []
        self._root: Element | None = None
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end

    def parse(self, data: bytes) -> Element:
        """Root element of the bytes."""
        parse_strictly(self._parser, data, self._file)
        if self._root is None:
            raise InputError(f"{self._file}: expected an XML file with a root element")
        return self._root

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        """An element opens."""
        element = Element(tag, attributes, self._file, self._parser.CurrentLineNumber)
        if len(self._open) >= MAX_DEPTH:
            raise element.error(f"expected at most {MAX_DEPTH} nested elements")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        """An element closes."""
        self._open.pop()


class Remarks:
    """Gathers remarks; of each kind the first one is kept and the others are counted."""

    def __init__(self) -> None:
        """Start with none."""
        self._first: dict[str, str] = {}
        self._count: Counter[str] = Counter()

    def add(self, kind: str, text: str, element: Element | None = None) -> None:
        """Note something; ``kind`` says which remarks are the same but for their place."""
        place = f"{element.file}:{element.line}: " if element is not None else ""
        self._first.setdefault(kind, place + text)
        self._count[kind] += 1

    @property
    def lines(self) -> tuple[str, ...]:
        """One line for each kind, in the order of their first occurrence."""
        return tuple(
            text + (f" (and {self._count[kind] - 1} more)" if self._count[kind] > 1 else "")
            for kind, text in self._first.items()
        )
