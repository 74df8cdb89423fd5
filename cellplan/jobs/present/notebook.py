"""Results as a notebook shows them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np

from cellplan.errors import InputError
from cellplan.jobs.present.kinds import KINDS, RUN, TASK_COLUMNS, record_of
from cellplan.jobs.present.result_tables import NOWHERE, record_at, tables_of
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.planning.layout_screening import Screening
from cellplan.report.page.figures import figure, key_figures
from cellplan.report.page.notebook import Card, Grid, card_html
from cellplan.report.plots.figure import Figure
from cellplan.report.plots.run import run_figures
from cellplan.report.plots.svg import svg_text
from cellplan.report.record.common import Record
from cellplan.report.record.numbers import seconds, small
from cellplan.report.record.rows import format_of, run_tables
from cellplan.report.record.run import ReportedPhase
from cellplan.report.record.summary import program_records
from cellplan.runs.solution import Solution

Pictures = dict[str, str]  # SVG by what it shows


def to_html(result: object) -> str:
    """What a notebook shows of a result: verdict, key figures, pictures and short tables.

    A piece of HTML of less than 200 kB without scripts, links and a style sheet. Results show it by themselves; for a
    record, as ``sweep`` returns it, write ``IPython.display.HTML(cellplan.to_html(record))``.

    Args:
        result: What ``to_frame`` takes.

    Raises:
        InputError: It is no result that can be shown, or its files cannot be read.
    """
    return card_html(card_of(result))


@singledispatch
def card_of(result: object) -> Card:
    """What a notebook shows of a result.

    Args:
        result: What ``to_frame`` takes.

    Raises:
        InputError: It is no result that can be shown.
    """
    record = record_of(result)
    if record is not None:
        return _record_card(record)
    raise InputError(f"to_html: expected a result, a record or a path, got {type(result).__name__}")


@card_of.register
def _(result: Mapping) -> Card:  # type: ignore[type-arg]
    return _record_card(result)


@card_of.register
def _(result: Path) -> Card:
    return _record_card(record_at(result))


@card_of.register
def _(result: Solution) -> Card:
    return _program_card("Solution", result.cell, result.runs)


@card_of.register
def _(result: VerifiedRun) -> Card:
    return replace(_program_card("Verified run", result.cell, result.motions), findings=result.remarks)


@card_of.register
def _(result: Report) -> Card:
    failed = [check.message for check in result.checks if not check.passed]
    checks = f"{len(result.checks)} checks" if not failed else f"{len(failed)} of {len(result.checks)} checks"
    clearance = tables_of(result)["clearance"]()
    figures = [figure("Cycle time", seconds(result.cycle_time), "s", note=result.mode)]
    return Card(
        kind="Report" if result.phase is None else f"Report of {result.phase}",
        name=result.cell,
        verdict=f"{'failed' if failed else 'passed'}: {checks}",
        passed=not failed,
        findings=failed,
        figures=figures,
        grids=[
            _grid("Smallest distances", clearance, ("class", "minimum_mm", "first", "second", "at_s"), "clearance"),
            _grid(
                "Joints nearest to their limits",
                _sorted(tables_of(result)["joints"](), "margin"),
                ("joint", "robot", "unit", "margin", "margin_at_s", "velocity_ratio", "acceleration_ratio"),
                "joints",
            ),
        ],
    )


@card_of.register
def _(result: Cell) -> Card:
    tables = tables_of(result)
    robots, tasks = tables["robots"](), tables["tasks"]()
    return Card(
        kind="Cell",
        name=result.name,
        figures=[
            figure("Mode", str(result.motion.mode), "", note=""),
            figure("Part", _part_text(result), "", note=""),
            figure("Required clearance", small(result.checks.clearance_mm), "mm"),
        ],
        grids=[
            _grid("Robots", robots, ("robot", "model", "role", "joints", "x_mm", "y_mm", "z_mm", "yaw_deg"), "robots"),
            _grid(
                "Tasks", tasks, ("task", "robot", "path", "relative_to", "start_s", "duration_s", "feed_mm_s"), "tasks"
            ),
        ],
    )


@card_of.register
def _(result: Screening) -> Card:
    followed, feasible = int(result.is_followed.sum()), int(result.is_feasible.sum())
    tables = tables_of(result)
    return Card(
        kind="Screening",
        name=f"{len(result.start)} layouts"
        if result.cell is None
        else f"{result.cell.name}: {len(result.start)} layouts",
        figures=[
            figure("Follow the paths", str(followed), "", note=""),
            figure("Within all limits", str(feasible), "", note="collisions are not checked"),
        ],
        grids=[_grid("Layouts", tables["candidates"](), (), "candidates")],
    )


def _part_text(cell: Cell) -> str:
    """What the part is and who holds it."""
    holders = ", ".join(cell.positioners)
    return f"{type(cell.part.shape).__name__}, {f'held by {holders}' if holders else 'fixed in the world'}"


def _program_card(kind: str, cell: Cell, phases: Sequence[ReportedPhase]) -> Card:
    """A program, with the pictures of its phase that leaves the smallest clearance."""
    whole = program_records(phases, cell=cell, provenance=NOWHERE).whole
    failed = [check["message"] for check in whole["checks"] if not check["passed"]]
    count, nearest = len(whole["checks"]), min(phases, key=_smallest_clearance)
    tables = run_tables([whole])
    return Card(
        kind=kind,
        name=cell.name,
        verdict=f"failed: {len(failed)} of {count} checks" if failed else f"passed: {count} checks",
        passed=not failed,
        findings=failed,
        figures=key_figures(whole),
        pictures=run_pictures(nearest.report, nearest.cell),
        grids=[_grid("Tasks", tables["tasks"](), TASK_COLUMNS, "tasks")],
    )


def _smallest_clearance(phase: ReportedPhase) -> float:
    """Smallest distance of a phase in [m]; infinite without pairs."""
    distances = [minimum.minimum for minimum in phase.report.clearance.minima.values() if minimum.minimum is not None]
    return min(distances, default=np.inf)


def _record_card(record: Record) -> Card:
    """A record: its verdict, its pictures and the tables that are shown of its kind."""
    tables, kind = tables_of(record), KINDS[format_of(record)]
    varied = record.get("vary", ())  # addresses of a sweep
    grids = [
        _grid(name.capitalize(), tables[name](), (*varied, *columns), name) for name, columns in kind.shown.items()
    ]
    status = str(record.get("status", ""))
    counts = {name: count for name, count in record.get("counts", {}).items() if count}
    verdict = status.replace("_", " ") or ", ".join(
        f"{count} {name.replace('_', ' ')}" for name, count in counts.items()
    )
    return Card(
        kind=kind.title,
        name=record["cell"],
        verdict=verdict,
        passed=status in kind.good if status else None,
        findings=[check["message"] for check in record.get("checks", ()) if not check["passed"]],
        figures=key_figures(record) if kind is RUN else [],
        pictures=record_pictures(record),
        grids=grids,
    )


def _grid(caption: str, columns: Mapping[str, Any], names: Sequence[str], table: str) -> Grid:
    selected = {name: columns[name] for name in names if name in columns} if names else dict(columns)
    shown = {name: values.tolist() if isinstance(values, np.ndarray) else values for name, values in selected.items()}
    return Grid(caption=caption, columns=shown, more=f'to_frame("{table}")')


def _sorted(columns: Mapping[str, Sequence[Any]], name: str) -> dict[str, list[Any]]:
    """A table in the order of one of its columns, rows without a value there last."""
    values = columns[name]
    order = sorted(range(len(values)), key=lambda row: (values[row] is None, values[row]))
    return {key: [column[row] for row in order] for key, column in columns.items()}


def run_pictures(report: Report, cell: Cell) -> Pictures:
    """Clearance over time, and the joints that come nearest to their limits."""
    shown = {
        name: figure for name, figure in run_figures(report, cell=cell).items() if name in ("clearance", "margins")
    }
    return _pictures(shown, cell.name)


def record_pictures(record: Record) -> Pictures:
    """The pictures that are shown of a record."""
    figures = KINDS[format_of(record)].pictures(record)
    return _pictures({name: figure for name, figure in figures.items() if figure is not None}, record["cell"])


def _pictures(figures: Mapping[str, Figure], cell: str) -> Pictures:
    """Figures as SVG by what they show."""
    return {f"{cell}: {name.replace('_', ' ')}": svg_text(figure) for name, figure in figures.items()}
