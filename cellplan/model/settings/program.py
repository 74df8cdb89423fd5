"""Programs from home to home: cycles, marks, and where the part lies before and after."""

from collections.abc import Collection, Iterable, Iterator
from itertools import pairwise, zip_longest
from typing import Annotated, ClassVar, Final, Self

from pydantic import Field, Tag, model_validator

from cellplan.geometry.transforms import Array
from cellplan.model.settings.entry import Entry, Name, PoseEntry, SlidingSpeed, by_kind, rule, setting
from cellplan.model.settings.task import FARTHEST_STAND_OFF_MM, LONGEST_S, MOST_CYCLES
from cellplan.model.settings.units import Mm, Within

MARK_LIMIT: Final = 200
MARK_WORDS: Final = "a name or {name: m1, dwell_s: 0.5}"
StraightMove = Annotated[Mm, Within(gt=0.0, le=FARTHEST_STAND_OFF_MM)]


class MarkEntry(Entry):
    """A point at which robots wait for one another."""

    name: Name = Field(description="Name of the mark, unlike that of any task.")
    dwell_s: Annotated[float, Field(ge=0.0, le=LONGEST_S)] = setting(
        0.0, "Time for which all robots of the cell stand still at the mark."
    )


MarkChoice = Annotated[
    Annotated[Name, Tag(f"<{MARK_WORDS}>")] | Annotated[MarkEntry, Tag("<mapping>")], by_kind(MARK_WORDS, mapping=dict)
]

LEAST_PERCENT: Final = 1.0  # of the speed of joints: a slower move is a wrong unit
WIDEST_REST_MM: Final = 10.0  # a part farther from what it rests on would fall
SUPPORT_LIMIT: Final = 20
SUPPORT_WORDS: Final = "the name of a body or a list of them"
Supports = Annotated[
    Annotated[Name, Tag(f"<{SUPPORT_WORDS}>")]
    | Annotated[tuple[Name, ...], Field(min_length=1, max_length=SUPPORT_LIMIT), Tag("<list>")],
    by_kind(SUPPORT_WORDS, list=tuple),
]


class PartPlaceEntry(Entry):
    """A place at which the part lies without a robot that holds it."""

    at: PoseEntry = Field(description="Pose of the part frame in the world.")
    rests_on: Supports | None = setting(
        None, "Body of the environment, or list of bodies, that the part rests on: it touches each of them."
    )
    rest_gap_mm: Annotated[Mm, Within(ge=0.0, le=WIDEST_REST_MM)] = setting(
        Mm(1.0), "Largest distance of the part from each body that it rests on."
    )
    clamped: bool = setting(
        False,
        "Whether a nest, magnet or hook holds the part there: it need not touch what it rests on, or name anything.",
    )
    contact_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_STAND_OFF_MM)] | None = setting(
        None,
        "Length of the end of the approach in which what grips may touch the part, and of the beginning of the lift "
        "in which the part may touch what it rests on; likewise when it is put down. The depth of the grip when "
        "absent.",
    )
    approach_mm: StraightMove = setting(
        Mm(50.0),
        "Length of the straight move of the holder to the part before it grips, or away from it after it lets go, "
        "along its tool axis.",
    )
    lift_mm: StraightMove = setting(
        Mm(50.0), "Height over which the part is moved straight up from its place, or down to it."
    )

    @property
    def X_WP(self) -> Array:
        """The part frame in the world, shape (4, 4)."""
        return self.at.matrix

    @property
    def supports(self) -> tuple[str, ...]:
        """Names of the bodies that the part rests on."""
        return (self.rests_on,) if isinstance(self.rests_on, str) else self.rests_on or ()


class TransferEntry(Entry):
    """How fast transfer moves are at most."""

    speed_percent: Annotated[float, Field(ge=LEAST_PERCENT, le=100.0)] = setting(
        100.0,
        "Speed of transfer moves in percent of what the joints can do, as if time ran slower: it scales accelerations "
        "by its square, jerks by its cube.",
    )
    tcp_mm_s: SlidingSpeed | None = setting(
        None,
        "Largest speed in the world of any tool tip, any flange and any point of a part that is held, in transfer "
        "moves.",
    )

    @property
    def share(self) -> float:
        """The share of the speed that joints have."""
        return self.speed_percent / 100.0


MOST_GROUPS: Final = 200
GROUP_WORDS: Final = "the name of a task or a list of names"
TaskGroups = Annotated[
    tuple[
        Annotated[
            Annotated[Name, Tag(f"<{GROUP_WORDS}>")]
            | Annotated[tuple[Name, ...], Field(min_length=2, max_length=MOST_GROUPS), Tag("<list>")],
            by_kind(GROUP_WORDS, list=tuple),
        ],
        ...,
    ],
    Field(max_length=MOST_GROUPS),
]


class OrderEntry(Entry):
    """An order of tasks of any robots."""

    alternate: Annotated[tuple[Annotated[tuple[Name, ...], Field(min_length=1)], ...], Field(min_length=2)] = Field(
        description="Lists of tasks that take turns: the first of each list, then the second of each, and so on. A "
        "task begins when the one before it is done."
    )


class ProgramEntry(Entry):
    """A program from home to home: transfer moves lead from the homes to the tasks, between them, and back."""

    is_home_to_home: ClassVar[bool] = True

    cycles: Annotated[int, Field(ge=1, le=MOST_CYCLES)] = setting(1, "How often all of the program is done.")
    marks: tuple[MarkChoice, ...] = setting(
        (),
        "Points at which robots wait for one another. A mark stands in the order of every robot that takes part: "
        "these go on when all of them have come to it. A robot without the mark in its order does not take part.",
        max_length=MARK_LIMIT,
    )
    attach: PartPlaceEntry | None = setting(
        None, "Where the part lies as an obstacle until it is gripped; held from the beginning when absent."
    )
    detach: PartPlaceEntry | None = setting(
        None, "Where the part is put down after the last task; held to the end when absent."
    )

    transfer: TransferEntry = setting(TransferEntry(), "How fast transfer moves are at most.")
    same_robot: TaskGroups = setting((), "Tasks that one robot does: a list of them, or several such lists.")
    together: TaskGroups = setting(
        (),
        "Tasks whose tools begin their paths at the same time, both sides of a web at once for example: a list of "
        "them, or several such lists.",
    )
    order: OrderEntry | None = setting(None, "Tasks that take turns; any order when absent.")
    tacks_first: bool = setting(False, "Whether all tasks with tack: true are done before any other task begins.")
    rest_s: Annotated[float, Field(gt=0.0, le=LONGEST_S)] | None = setting(
        None,
        "Time for which the part cools between the end of a path and the begin of another one that is a pass of the "
        "same seam, which lies within 10 mm of it all along, or comes nearer to it than apart_mm. Tasks that begin "
        "together need no rest between each other.",
    )
    apart_mm: Annotated[Mm, Within(gt=0.0, le=FARTHEST_STAND_OFF_MM)] | None = setting(
        None, "Distance of two paths below which rest_s holds between them; passes only when absent."
    )
    arcs_apart_mm: Annotated[Mm, Within(gt=0.0, le=FARTHEST_STAND_OFF_MM)] | None = setting(
        None,
        "Least distance of the tips of two tools that are on their paths at the same time, so that arcs do not "
        "disturb each other; any when absent.",
    )

    @model_validator(mode="after")
    def _has_groups(self) -> Self:
        """Tasks or lists of tasks, at least two in each; a distance only for a rest."""
        if self.apart_mm is not None and self.rest_s is None:
            raise rule("unexpected key without rest_s, the rest between tasks that are nearer", "apart_mm")
        for key, given in (("same_robot", self.same_robot), ("together", self.together)):
            if len({isinstance(it, str) for it in given}) > 1:
                raise rule("expected either tasks or lists of tasks, got both", key)
            if len(given) == 1 and isinstance(given[0], str):
                raise rule("expected at least two tasks, got one", key)
        return self

    @property
    def apart(self) -> float:
        """Distance in [m] of two paths below which a rest holds between them; 0 for passes only."""
        return 0.0 if self.apart_mm is None else self.apart_mm.si

    def in_order(self, tacks: Collection[str], tasks: Iterable[str]) -> Iterator[tuple[str, str, str]]:
        """Tasks of which the first is done before the second begins, with the key that says so."""
        turns = [it for names in zip_longest(*(self.order.alternate if self.order else ())) for it in names if it]
        yield from ((first, second, "order.alternate") for first, second in pairwise(turns))
        if self.tacks_first:
            seams = [name for name in tasks if name not in tacks]
            yield from ((tack, seam, "tacks_first") for tack in tacks for seam in seams)

    @property
    def all_marks(self) -> tuple[MarkEntry, ...]:
        """The marks, those given by name only with their defaults."""
        return tuple(mark if isinstance(mark, MarkEntry) else MarkEntry(name=mark) for mark in self.marks)


def groups_of(given: TaskGroups) -> tuple[tuple[str, ...], ...]:
    """The lists of tasks of a rule that may be given as one list."""
    names = tuple(it for it in given if isinstance(it, str))
    return (names,) if names else tuple(it for it in given if not isinstance(it, str))


class NoTransfers(ProgramEntry):
    """A program whose tasks begin and end where they are worked on: one cycle, without marks and transfer moves."""

    is_home_to_home: ClassVar[bool] = False
