"""A rehearsal as text: verdict, true errors before and after correction, convergence, location of the report."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import seconds, small

TITLES: Final = {"before": "as solved", "after": "corrected", "in_pass": "corrected within the pass"}
OUTCOMES: Final = {
    "converged": "converged",
    "stalled": "does not converge: the error stopped decreasing",
    "diverged": "does not converge: the error grew, or the corrected references cannot be followed",
    "unfinished": "has not converged: allow more --rounds",
}


def summary_lines(record: Record, folder: Path) -> list[str]:
    """All lines about one rehearsal."""
    cells = "one real cell" if record["trials"] == 1 else f"{record['trials']} real cells"
    return [
        f"{record['cell']}: {record['status']}",
        f"  mode {record['mode']}, {seconds(record['cycle_time_s'])} s, rehearsed on {cells}, seed {record['seed']}",
        *_task_lines(record),
        *_repeatability_lines(record["tasks"]),
        *_round_lines(record["runs"]),
        *(f"  FAILED {check['message']}" for check in record["checks"] if not check["passed"]),
        *(f"  {line}" for line in record["not_in_program"]),
        f"report: {folder / 'rehearsal.html'}",
        *([f"tables: {folder / 'tables'}"] if record["tables_released"] else []),
    ]


def _task_lines(record: Record) -> Iterator[str]:
    for name, task in record["tasks"].items():
        for key, title in TITLES.items():
            place, found = f"  task {name} ({task['robot']}), {title}", task[key]
            if found is not None:
                position, orientation = found["max_position_error_mm"], found["max_orientation_error_deg"]
                lost = record["trials"] - found["trials"]
                yield f"{place}: true error {small(position)} mm, {small(orientation)} deg" + (
                    f", path lost in {lost} trials" if lost else ""
                )
            elif key == "in_pass" and record["in_pass"]:
                yield f"{place}: the path was lost"


def _repeatability_lines(tasks: Record) -> Iterator[str]:
    """Path accuracy and repeatability where there is more than one trial."""
    for name, task in tasks.items():
        for key, figures in task["iso_9283"].items():
            if figures is not None and figures["RT_p_mm"] is not None:
                accuracy, spread = figures["AT_p_mm"], figures["RT_p_mm"]
                yield f"  task {name}, {TITLES[key]}: AT_p {small(accuracy)} mm, RT_p {small(spread)} mm"


def _round_lines(runs: Iterable[Record]) -> Iterator[str]:
    """Outcome of the correction: the convergence table of a single cell, or the count of each outcome."""
    for run in runs:
        where = f"{run['name']}: " if run["name"] else ""
        corrections = [trial["correction"] for trial in run["trials"] if trial["correction"] is not None]
        for outcome, text in OUTCOMES.items():
            count = sum(correction["outcome"] == outcome for correction in corrections)
            if count:
                share = f" in {count} of {len(corrections)} trials" if len(corrections) > 1 else ""
                yield f"  {where}feedback {text}{share}"
        if len(corrections) == 1:
            for made in corrections[0]["rounds"]:
                share = small(made["share_of_tolerance"])
                yield f"    round {made['round']}: largest true error {share} of its tolerance"
