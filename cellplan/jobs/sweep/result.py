"""A study of one cell as record, table, text, plot and page: what is shown, and in which order."""

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.model.report.report import CAUTION
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.plots.figure import Figure, Item, Limit, PlotAxis, PlotCurve, PlotMark, PlotPanel, value_axis
from cellplan.report.plots.palette import LIMIT, ROBOTS
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Entries, Record, as_json
from cellplan.report.record.figures import KEY, SHOWN, csv_text, terminal_lines
from cellplan.report.record.rows import Tables, columns_of, flat
from cellplan.study.trial import STATUS_TEXTS, TrialStatus

SCHEMA: Final = "cellplan.study/1"
COLUMNS: Final = ("cycle_time_s", "max_velocity_ratio", "max_acceleration_ratio", "min_margin_deg", "min_clearance_mm")
MAX_ROWS: Final = 40  # on the terminal; more are in the table on disk
MAX_REASON: Final = 72  # characters
MAX_CURVES: Final = len(ROBOTS)


def study_record(header: Mapping[str, Any], trials: Sequence[Record]) -> dict[str, Any]:
    """The record of a study: content of ``study.json``.

    Args:
        header: What the study is about: kind, cell, settings, task, vary, inputs and versions.
    """
    counts = Counter(trial["status"] for trial in trials)
    about = {key: header[key] for key in ("kind", "cell", "settings", "task", "vary")}
    return {
        "schema": SCHEMA,
        **about,
        "counts": {str(status): counts[status] for status in TrialStatus},
        "trials": [{key: trial[key] for key in ("trial", "values", "status", "reason", "figures")} for trial in trials],
        "inputs": header["inputs"],
        "versions": header["versions"],
    }


def study_table(record: Record) -> str:
    """The trials as CSV: a row for each, with its values, its status and its figures."""
    rows = (
        [trial["trial"], *map(trial["values"].get, record["vary"]), trial["status"]]
        + [trial["figures"].get(key) for key in KEY]
        + [trial["reason"]]
        for trial in record["trials"]
    )
    return csv_text([["trial", *record["vary"], "status", *KEY, "reason"], *rows])


def study_lines(record: Record, folder: Path) -> list[str]:
    """All lines on the terminal: counts, a row for each variant, and where the files are."""
    counts, trials = record["counts"], record["trials"][:MAX_ROWS]
    others = [f"{count} {status.replace('_', ' ')}" for status, count in counts.items() if status != "passed" and count]
    rows = [[*record["vary"], "verdict", *(SHOWN[key].column for key in COLUMNS)], *map(_cells, trials)]
    reasons = ["", *(trial["reason"] for trial in trials)]
    shown = (reason if len(reason) <= MAX_REASON else f"{reason[:MAX_REASON]}…" for reason in reasons)
    more = len(record["trials"]) - MAX_ROWS
    return [
        f"{record['cell']}: {counts['passed']} of {len(record['trials'])} variants passed",
        *([f"  {', '.join(others)}"] if others else []),
        *(f"{line}  {reason}".rstrip() for line, reason in zip(terminal_lines(rows, "  "), shown, strict=True)),
        *([f"  and {more} more in study.csv"] if more > 0 else []),
        f"report: {folder / 'study.html'}",
        f"table: {folder / 'study.csv'}",
    ]


def _cells(trial: Record) -> list[str]:
    """One row but for its reason."""
    figures = [SHOWN[key].text(trial["figures"].get(key)) for key in COLUMNS]
    return [*map(str, trial["values"].values()), trial["status"].replace("_", " "), *figures]


def study_figures(record: Record) -> dict[str, Figure]:
    """Figures over the first varied number, a curve for each combination of the other values; none without one."""
    address = _varied_number(record)
    curves = dict(_curves(record, address)) if address else {}
    x = [float(trial["values"][address]) for trials in curves.values() for trial in trials]
    if address is None or not x or len(curves) > MAX_CURVES or min(x) == max(x):
        return {}
    solved = [trial["figures"] for trials in curves.values() for trial in trials]
    shown = [key for key in COLUMNS[1:] if any(figures[key] is not None for figures in solved)]
    figure = Figure(
        title=f"{record['cell']}: key figures over {address}; failed variants in red",
        x=PlotAxis(low=min(x), high=max(x), label=address),
        panels=[_panel(key, curves, address) for key in shown],
        columns=2,
    )
    return {"study": figure}


def _panel(key: str, curves: Mapping[str, Entries], address: str) -> PlotPanel:
    """One figure: a curve for each combination of the other values, a dot for each variant, red if it failed."""
    shown = SHOWN[key]
    known = {others: [it for it in trials if it["figures"][key] is not None] for others, trials in curves.items()}
    shown_values = [shown.percent * trial["figures"][key] for trials in known.values() for trial in trials]
    items: list[Item] = [Limit(shown.limit)] if shown.limit is not None and min(shown_values) < shown.limit else []
    for colour, (others, trials) in zip(ROBOTS, known.items(), strict=False):
        at = [float(trial["values"][address]) for trial in trials]
        values = [shown.percent * trial["figures"][key] for trial in trials]
        items.append(PlotCurve(others, np.array(at), np.array(values), colour))
        pens = [colour if trial["status"] == "passed" else LIMIT for trial in trials]
        items += [PlotMark(*point) for point in zip(at, values, pens, strict=True)]
    return PlotPanel(
        title=shown.plot,
        y=value_axis(min(shown_values), max(*shown_values, shown.limit or max(shown_values))),
        items=items,
    )


def _varied_number(record: Record) -> str | None:
    """Address of the first varied key whose values are all finite numbers; None if there is none."""
    for address, values in record["vary"].items():
        numbers = [
            it for it in values if isinstance(it, int | float) and not isinstance(it, bool) and math.isfinite(it)
        ]
        if 1 < len(values) == len(numbers):
            return str(address)
    return None


def _curves(record: Record, address: str | None) -> Iterator[tuple[str, Entries]]:
    """Trials with a motion, by the values of all keys but one, in the order of that key."""
    curves: dict[str, Entries] = {}
    for trial in record["trials"]:
        others = ", ".join(f"{key} = {value}" for key, value in trial["values"].items() if key != address)
        if trial["figures"]:
            curves.setdefault(others, []).append(trial)
    for others, trials in curves.items():
        yield others, sorted(trials, key=lambda trial: trial["values"][address]) if address else trials


def study_files(record: Record, formats: Collection[str] = ()) -> dict[str, bytes]:
    """Content of the files of a study by name, its plot in SVG and in further formats."""
    plots, across = pictures(study_figures(record), formats), _varied_number(record)
    curves = dict(_curves(record, across))
    page = template("jobs/sweep/study.html").render(
        r=record,
        plot=inline_svg(plots["study.svg"].decode()) if "study.svg" in plots else "",
        across=across,
        legend=list(zip(ROBOTS, curves, strict=False)) if 1 < len(curves) <= MAX_CURVES else [],
        statuses=STATUS_TEXTS,
        caution=CAUTION,
    )
    return {
        "study.json": as_json(record).encode(),
        "study.csv": study_table(record).encode(),
        **plots,
        "study.html": page.encode(),
    }


def study_tables(record: Record) -> Tables:
    """The table of frames and notebooks: a row for each variant."""
    names = ["trial", *record["vary"], "status", *KEY, "reason"]
    return {"trials": lambda: columns_of(map(flat, record["trials"]), names)}


STUDY: Final = ResultKind(
    name="study",
    title="Sweep",
    tables=study_tables,
    shown={"trials": ("status", "cycle_time_s", "min_margin_deg", "max_velocity_ratio", "min_clearance_mm", "reason")},
    pictures=study_figures,
)
