"""Poses as the pendants of the makers have them, both ways: millimetres, and an orientation as each maker counts it.

Where the second of three angles is a quarter turn, the first turn and the last are about one axis: all of it is given
to the turn about z, and the turn about x is zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import (
    Array,
    pose_from,
    quaternion_to_rotation,
    rotation_exp,
    rotation_from_rpy,
    rotation_vector,
    rpy_from_rotation,
)
from cellplan.model.units import DEG, MM
from cellplan.programs.elements.text import fixed

LENGTH_DECIMALS: Final = 3  # of a millimetre
QUATERNION_DECIMALS: Final = 7  # as many as a number of the controller holds


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Convention:
    """How controllers of a kind state a pose.

    Attributes:
        labels: Names of the numbers: three lengths in [mm], then those of the orientation.
        turn: Numbers of a rotation, shape (3, 3).
        rotation: The rotation of these numbers.
        decimals: Decimals of the orientation.
        unit: Its unit; empty for a quaternion.
        tool: What a tool is called, its number in braces.
        frame: What a frame of the part is called, likewise.
        has_numbers: Whether it knows them by number, and not by name.
    """

    labels: tuple[str, ...]
    turn: Callable[[Array], Array]
    rotation: Callable[[Array], Array]
    tool: str
    frame: str
    decimals: int = 4
    unit: str = "deg"
    has_numbers: bool = False

    def numbers(self, X: Array) -> Array:
        """Numbers of a pose in [m], shape (4, 4)."""
        return np.concatenate([MM * X[:3, 3], self.turn(X[:3, :3])])

    def pose(self, numbers: Array) -> Array:
        """The pose in [m], shape (4, 4), of numbers."""
        return pose_from(self.rotation(np.asarray(numbers[3:])), np.asarray(numbers[:3]) / MM)

    def named(self, words: str, number: int | None) -> str:
        """A tool or frame with its number; one that is known by number has a question mark where none is stated."""
        if number is None and not self.has_numbers:
            return words.replace(" {}", "")
        return words.format("?" if number is None else number)

    def texts(self, X: Array) -> tuple[str, ...]:
        """Numbers of a pose as they are typed; a half turn is a positive one."""
        lengths = [fixed(length, LENGTH_DECIMALS) for length in MM * X[:3, 3]]
        turns = [fixed(number, self.decimals) for number in self.turn(X[:3, :3])]
        half = fixed(-180.0, self.decimals)
        return (*lengths, *(turn.removeprefix("-") if turn == half else turn for turn in turns))


def quaternions(R: Array) -> Array:
    """Unit quaternions w, x, y, z of rotations, shape (N, 3, 3) to (N, 4), each on the side of the one before it.

    The largest component is found first, from the diagonal; the others follow from sums and differences of pairs.
    """
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    x, y, z = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    xy, xz, yz = R[:, 1, 0] + R[:, 0, 1], R[:, 0, 2] + R[:, 2, 0], R[:, 2, 1] + R[:, 1, 2]
    outer = np.array(  # 4 q q^T, shape (4, 4, N)
        [
            [1 + xx + yy + zz, x, y, z],
            [x, 1 + xx - yy - zz, xy, xz],
            [y, xy, 1 - xx + yy - zz, yz],
            [z, xz, yz, 1 - xx - yy + zz],
        ]
    )
    largest = np.argmax(np.diagonal(outer), axis=1)
    quaternion = np.moveaxis(outer, -1, 0)[np.arange(len(R)), largest]
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    if len(quaternion):
        quaternion[0] *= np.where(quaternion[0, 0] < 0.0, -1.0, 1.0)
        turns = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0
        quaternion[1:] *= np.where(np.cumsum(turns) % 2 == 1, -1.0, 1.0)[:, None]
    return quaternion


def convention_of(kind: str | None) -> Convention:
    """The convention of a kind of controller; that of a cell file where no maker's is known."""
    return CONVENTIONS.get(kind or "", CELL_FILE)


CELL_FILE: Final = Convention(  # turns in [deg] about the fixed axes x, y, z
    labels=("x", "y", "z", "roll", "pitch", "yaw"),
    turn=lambda R: DEG * rpy_from_rotation(R),
    rotation=lambda turns: rotation_from_rpy(turns / DEG),
    tool="tool {}",
    frame="frame {}",
)
CONVENTIONS: Final = {
    "abb": Convention(
        labels=("x", "y", "z", "q1", "q2", "q3", "q4"),
        turn=lambda R: quaternions(R[None])[0],
        rotation=quaternion_to_rotation,
        tool="tooldata {}",
        frame="wobjdata {}",
        decimals=QUATERNION_DECIMALS,
        unit="",
    ),
    "fanuc": replace(
        CELL_FILE, labels=tuple("XYZWPR"), tool="UTOOL {}", frame="UFRAME {}", decimals=3, has_numbers=True
    ),
    "kuka": Convention(  # turns in [deg] about z, the turned y and the turned x
        labels=tuple("XYZABC"),
        turn=lambda R: DEG * rpy_from_rotation(R)[::-1],
        rotation=lambda turns: rotation_from_rpy(turns[::-1] / DEG),
        tool="TOOL_DATA[{}]",
        frame="BASE_DATA[{}]",
        has_numbers=True,
    ),
    "staubli": Convention(  # turns in [deg] about x, the turned y and the turned z
        labels=("x", "y", "z", "rx", "ry", "rz"),
        turn=lambda R: -DEG * rpy_from_rotation(R.T),
        rotation=lambda turns: rotation_from_rpy(-turns / DEG).T,
        tool="tool {}",
        frame="frame {}",
    ),
    "ur": Convention(
        labels=("X", "Y", "Z", "RX", "RY", "RZ"),
        turn=rotation_vector,
        rotation=rotation_exp,
        tool="TCP {}",
        frame="feature {}",
        decimals=6,
        unit="rad",
    ),
    "yaskawa": replace(
        CELL_FILE, labels=("X", "Y", "Z", "Rx", "Ry", "Rz"), tool="TOOL {}", frame="USER {}", has_numbers=True
    ),
}
