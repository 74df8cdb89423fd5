"""Records as tables: what JSON files hold in lists and by name, as rows of plain values under one line of names.

Keys and units are those of the record. What is held by name gets a column for the name. A record within a row is
flattened with a dot: ``tolerance.position_mm``; values by address, settings and figures have their own names. The two
bodies of a pair are ``first`` and ``second``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, get_type_hints

from cellplan.model.motion.plan import ALL_TASKS
from cellplan.report.record.common import CheckRecord, Record
from cellplan.report.record.sections.clearance import ClosestPair, Contact, LeftOutRecord

Row = dict[str, Any]
Table = Callable[[], dict[str, Any]]  # values of each column by its name
Tables = dict[str, Table]  # by name, the first one first

LIFTED: Final = frozenset({"values", "settings", "figures"})  # keys whose own keys need no prefix
PAIR: Final = "pair"
BODIES: Final = "bodies"  # one, two or many
BETWEEN: Final = " - "  # names of bodies
OF_PAIRS: Final[Mapping[str, tuple[str, str]]] = {
    "points_mm": ("first_point_mm", "second_point_mm"),
    "accuracies_mm": ("first_accuracy_mm", "second_accuracy_mm"),
}


def columns_of(rows: Iterable[Row], names: Iterable[str] = ()) -> dict[str, Any]:
    """Values by column, those named first and always there; None where a row has none."""
    columns = list(rows)
    every = dict.fromkeys([*names, *(name for row in columns for name in row)])
    return {name: [row.get(name) for row in columns] for name in every}


def format_of(record: Record) -> str:
    """What kind of record it is: ``report``, ``series``, ``study`` of a sweep, ``comparison``, ``layout`` and so on."""
    name = str(record.get("schema", "")).partition("/")[0].removeprefix("cellplan.")
    return "comparison" if name == "study" and "variants" in record else name


def run_tables(records: Sequence[Record]) -> Tables:
    """Tables from the ``report.json`` of each phase of a program; each row begins with the name of its phase."""

    def column(make: Callable[[Record], Iterable[Row]], names: Sequence[str] = ()) -> Table:
        def rows() -> Iterator[Row]:
            rows = ((row.get("phase") or _phase(record), row) for record in records for row in make(record))
            return ({"phase": phase} | row | {"phase": phase} for phase, row in rows)

        return lambda: columns_of(rows(), ["phase", *names] if names else ())

    return {
        "checks": column(lambda record: map(flat, record["checks"]), columns_named(CheckRecord)),
        "joints": column(_joints),
        "tasks": column(lambda record: by_name(record["tasks"], "task")),
        "clearance": column(lambda record: by_name(record["clearance"], "class")),
        "closest_pairs": column(lambda record: map(flat, record.get("closest_pairs", ())), columns_named(ClosestPair)),
        "contacts": column(lambda record: map(flat, record.get("contacts", ())), columns_named(Contact)),
        "left_out": column(lambda record: map(flat, record["left_out"]), columns_named(LeftOutRecord)),
        "speeds": column(lambda record: by_name(record.get("speeds", {}), "robot")),
        "motion_share": column(lambda record: by_name(record.get("motion_share", {}), "robot")),
    }


def flat(entry: Mapping[str, Any], prefix: str = "") -> Row:
    """One row of a record: nested records flattened with a prefix, pairs as two columns."""
    row: Row = {}
    for key, value in entry.items():
        if key == PAIR:
            first, second = value or (None, None)
            row |= {f"{prefix}first": first, f"{prefix}second": second}
        elif key == BODIES:
            row[f"{prefix}{key}"] = BETWEEN.join(value)
        elif key in OF_PAIRS:
            row |= {f"{prefix}{name}": part for name, part in zip(OF_PAIRS[key], value or (None, None), strict=True)}
        elif isinstance(value, Mapping):
            row |= flat(value, prefix if key in LIFTED else f"{prefix}{key}.")
        else:
            row[f"{prefix}{key}"] = value
    return row


def by_name(entries: Mapping[str, Mapping[str, Any]], name: str) -> Iterator[Row]:
    """A row for each entry, which begins with its name."""
    return ({name: key, **flat(entry)} for key, entry in entries.items())


def curve_columns(tree: Mapping[str, Any]) -> dict[str, Any]:
    """The curves of a run as columns, a row for each kept sample; no value where a step would begin at the last one."""
    count = len(tree["times_s"])
    columns: dict[str, Any] = {"time_s": tree["times_s"]}
    for robot, joints in tree["joints"].items():
        columns |= {
            f"{robot}.{joint}.{key}": values for joint, of_task in joints.items() for key, values in of_task.items()
        }
    for task, of_task in tree["tasks"].items():
        columns |= {f"{task}.{key}": values for key, values in of_task.items()}
    columns |= dict(tree["conditioning"])
    columns |= {name: tree[name] for name in ("iterations", "slack") if tree[name] is not None}
    return {name: [*values, *[None] * (count - len(values))] for name, values in columns.items()}


def _joints(record: Record) -> Iterator[Row]:
    for robot, joints in record["joints"].items():
        yield from ({"robot": robot, **row} for row in by_name(joints, "joint"))


def _phase(record: Record) -> str:
    """Name of the phase of a record; that of all tasks together for the only one."""
    return str(record.get("phase") or ALL_TASKS)


def columns_named(form: Any) -> list[str]:
    """Columns of the rows of a record type, in the order of its keys."""
    keys = get_type_hints(form)
    return [name for key in keys for name in (("first", "second") if key == PAIR else [key])]


def listed_table(record: Record, key: str, form: Any = None, names: Iterable[str] = ()) -> Table:
    """Table of a list of records."""
    known = [*names, *(name for name in (columns_named(form) if form else ()) if name not in LIFTED)]
    return lambda: columns_of(map(flat, record.get(key) or ()), known)
