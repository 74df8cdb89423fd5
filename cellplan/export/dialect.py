"""Dialect: what a program format is, and the one signature that all formats share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cellplan.model.controllers import ControllerKind
from cellplan.model.exported import ExportFrame, ExportJob, Interpolation, ProgramRows, Promise, Targets

Render = Callable[[ExportJob], dict[str, str]]
Read = Callable[[ExportFrame, Mapping[str, str]], tuple[ProgramRows, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dialect:
    """A program format.

    Attributes:
        name: Name of the format.
        title: What it is, in a few words, for help and reports.
        render: Text of every file of a job, by its path in the folder of the export.
        read: What a reader of its own finds in these files: the rows of each program, in the order of the frame. It
            knows no row beforehand. Raises ``InputError`` with file and line where a text is not such a file.
        decimals: Of a degree, radian or millimetre in these files. Where ``kinds`` is not empty, so that the format is
            the language of a controller, a robot may state its own.
        promises: What the format can hold, the best first.
        interpolation: How its target moves the joints between two rows.
        kinds: Controllers that play it; empty for any.
        at_cycle: Whether rows lie on the cycle of the controller.
        is_thinned: Whether rows may be left out, as the target moves evenly between those that are written; not those
            that lie on the cycle of the controller.
        is_rounded: Whether its files round rows within a share of their segments; not those on the cycle either.
        lags: Whether the target follows with a latency, which must be stated before ``timed`` is promised.
        split: Most rows of a file or routine; None for no limit.
        shortest_time: Shortest time in [s] between two rows that targets are known to keep; 0 for no limit.
        is_proved: Whether that time is documented by the maker, not only known from practice.
        targets: What rows can state.
    """

    name: str
    title: str
    render: Render
    read: Read
    decimals: int
    promises: tuple[Promise, ...]
    interpolation: Interpolation = Interpolation.LINEAR
    kinds: frozenset[ControllerKind] = field(default_factory=frozenset)
    at_cycle: bool = False
    is_thinned: bool = False
    is_rounded: bool = False
    lags: bool = False
    split: int | None = None
    shortest_time: float = 0.0
    is_proved: bool = False
    targets: tuple[Targets, ...] = (Targets.JOINTS,)
