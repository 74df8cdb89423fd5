"""Text of TP programs: numbered instructions, points, and the sections round them."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Final

from cellplan.geometry.transforms import Array
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.handshake import HandshakeStep
from cellplan.programs.elements.pages import PagedProgram
from cellplan.programs.elements.text import ascii_text, fixed, joined
from cellplan.programs.formats.fanuc_ls.groups import KIND, MotionGroup
from cellplan.programs.formats.fanuc_ls.text import COMMENT, SLOTS

MOST_SLOTS: Final = 8
LINE_END: Final = "\r\n"
MOTIONS: Final = ("J ", "L ", "C ")
ATTRIBUTES: Final = (
    "PROTECT = READ_WRITE;",
    "TCD: STACK_SIZE = 0,",
    "TASK_PRIORITY = 50,",
    "TIME_SLICE = 0,",
    "BUSY_LAMP_OFF = 0,",
    "ABORT_REQUEST = 0,",
    "PAUSE_REQUEST = 0;",
)


@dataclass(slots=True)
class TpText:
    """A program while it is written."""

    name: str
    groups: Sequence[MotionGroup]
    instructions: list[str]  # a line feed stands where one goes on in the next line
    points: list[list[str]] = field(default_factory=list)  # the lines of each point

    def point(self, poses: Iterable[Sequence[str]], name: str = "") -> str:
        """Add a point with its pose of each group, which may have a name; what it is called in motions."""
        number = len(self.points) + 1
        head = f'P[{number}:"{name}"]{{' if name else f"P[{number}]{{"
        self.points.append([head, *(line for pose in poses for line in pose), "};"])
        return f"P[{number}:{name}]" if name else f"P[{number}]"

    def move(self, motion: str, poses: Iterable[Sequence[str]]) -> None:
        """Add a motion, which has braces for its point."""
        self.instructions.append(motion.format(self.point(poses)))

    def rendered(self, cell: str) -> str:
        """The text of its file. It has no dates: the same rows give the same bytes."""
        moved = [group.number for group in self.groups]
        slots = SLOTS if max(moved) <= SLOTS else MOST_SLOTS
        lines = [
            f"{number:4d}:{'' if text.startswith(MOTIONS) else '  '}{text} ;".replace("\n", f"{LINE_END}    :  ")
            for number, text in enumerate(self.instructions, start=1)
        ]
        comment = re.sub(r"[^A-Za-z0-9 ._-]", "_", ascii_text(cell))[:COMMENT]
        head = [
            *("/PROG " + self.name, "/ATTR", "OWNER = MNEDITOR;", f'COMMENT = "{comment}";'),
            f"LINE_COUNT = {len(lines)};",
            *ATTRIBUTES,
            f"DEFAULT_GROUP = {','.join('1' if slot in moved else '*' for slot in range(1, slots + 1))};",
            "CONTROL_CODE = 00000000 00000000;",
        ]
        return joined([*head, "/MN", *lines, "/POS", *chain.from_iterable(self.points), "/END"], line_end=LINE_END)


def frames(group: MotionGroup, base: int | None = None) -> Iterator[str]:
    """What selects the frames of a group, which must be those of its points; another user frame may be given."""
    of_group = "" if group.number == 1 else f"[GP{group.number}]"
    yield f"UFRAME_NUM{of_group}={group.base if base is None else base}"
    yield f"UTOOL_NUM{of_group}={group.tool}"


def instruction(step: HandshakeStep) -> str:
    """One step of a handshake."""
    state = "ON" if step.is_on else "OFF"
    return f"WAIT DI[{step.signal}]={state}" if step.waits else f"DO[{step.signal}]={state}"


def joint_pose(group: MotionGroup, numbers: Array, decimals: int, base: int | None = None) -> list[str]:
    """What a point says of a group: its axes as they are written, shape (n,), three on a line."""
    axes = [
        f"{name} = {fixed(value, decimals)} {unit}"
        for (name, unit), value in zip(group.axes.items(), numbers[list(group.order)].tolist(), strict=True)
    ]
    return [*_begin(group, base), *_lines(axes)]


def tool_pose(group: MotionGroup, part: PagedProgram, row: int, X: Array, *, base: int, config: str) -> list[str]:
    """The same of a pose of its tool in a user frame, in [m], shape (4, 4), with the external axes of the row."""
    external = part.numbers[row][list(group.order[6:])].tolist()
    values = [*CONVENTIONS[KIND].numbers(X).tolist(), *external]
    axes = [
        f"{name} = {fixed(value, part.decimals)} {unit}"
        for (name, unit), value in zip(group.pose_axes.items(), values, strict=True)
    ]
    head, frame = _begin(group, base)
    return [head, f"{frame} CONFIG : '{config}',", *_lines(axes)]


def _begin(group: MotionGroup, base: int | None) -> tuple[str, str]:
    """The first lines of a pose."""
    return f"   GP{group.number}:", f"    UF : {group.base if base is None else base}, UT : {group.tool},"


def _lines(axes: Sequence[str]) -> Iterator[str]:
    """Three axes on a line, with commas between."""
    for first in range(0, len(axes), 3):
        yield f"    {', '.join(axes[first : first + 3])}{',' if first + 3 < len(axes) else ''}"
