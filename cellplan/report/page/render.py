"""``report.html``: verdict and evidence of a run as one self-contained page."""

import re
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from cellplan.model.cell import Cell
from cellplan.model.report import Check
from cellplan.report.page.compiled import TEMPLATES, CompiledTemplates
from cellplan.report.page.figures import key_figures
from cellplan.report.page.filters import fixed, floored, percent, power, range_bar, small, worst
from cellplan.report.plots.palette import ROBOTS, robot_colours
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.tasks import direction_text
from cellplan.report.text.method import method_lines
from cellplan.report.text.notes import grip_notes, left_out_notes, open_surface_notes

MODES: Final = {
    "simultaneous": "all robots move",
    "pairwise": "the positioner and one operator move at a time",
    "part_at_rest": "the positioner is at rest",
}
CHECKS: Final = {
    "joint_position": "joint positions within their limits",
    "joint_velocity": "joint velocities within their limits",
    "joint_acceleration": "joint accelerations within their limits",
    "joint_acceleration_assumed": "joint accelerations within assumed limits",
    "joint_acceleration_between_phases": "joint accelerations where phases meet within their limits",
    "joint_jerk": "joint jerk within its limits",
    "part_acceleration": "acceleration of the part within its limit",
    "tool_speed": "speed of the tools within its limit",
    "process_feed": "demanded feeds within their tolerances",
    "process_on_delay": "delays of processes at the start of their paths",
    "process_off_delay": "delays of processes at the end of their paths",
    "locked_joint": "failed joints at rest",
    "position_error": "tool position on the part within tolerance",
    "orientation_error": "tool orientation on the part within tolerance",
    "position_error_between_rows": "tool position within tolerance between the rows",
    "orientation_error_between_rows": "tool orientation within tolerance between the rows",
    "closure_position_error_between_rows": "tools of co-holders on their grasps between the rows",
    "closure_orientation_error_between_rows": "orientation of co-holders' tools between the rows",
    "closure_position_error": "tools of co-holders on their grasps",
    "closure_orientation_error": "orientation of co-holders' tools",
    "tool_depth": "tool depth in the part within its limit",
    "joint_drift": "joints return after each cycle",
    "clearance": "required clearance kept",
    "payload": "tool and part within the payload",
    "payload_centre": "centre of mass of the load within its limits",
    "payload_moment": "moments of the load on the wrist within their limits",
    "payload_inertia": "inertia of the load on the wrist within its limits",
    "collision": "no collision",
    "grip_depth": "depth of holders in the part within the depth of their grip",
    "mount_depth": "depth of tools in the arm within the depth of their mounting",
    "standing_depth": "depth of mounted bodies in their supports within its limit",
}
CLASSES: Final = {
    "whole": "whole cell",
    "robot_robot": "robot to robot",
    "self": "robot to itself",
    "part": "part",
    "environment": "environment",
}
EXECUTION_TITLES: Final = {
    "before": "as solved",
    "after": "corrected from pass to pass",
    "in_pass": "corrected within the pass",
}
OUTCOMES: Final = {
    "converged": "converged",
    "stalled": "does not converge: the error stopped decreasing above the tolerance",
    "diverged": "does not converge: the error grew, or the corrected references cannot be followed",
    "unfinished": "has not converged within the allowed rounds",
}
VIEW_PAGE: Final = "view.html"  # the 3-D page in a run folder
VIEW_LINKS: Final = '<p class="view-links">'  # stands in pages that lead to it
MAX_UNFOLDED: Final = 8  # robots; with more, pictures and long lists are folded
NARROW_FRACTION: Final = 0.05  # [-] fraction of the half range: smaller margins are marked
FAST_FRACTION: Final = 0.95  # [-] fraction of the speed limit: higher speeds are marked


def report_page(
    record: Record, checks: Iterable[Check], *, cell: Cell, plots: Mapping[str, bytes], view: str = ""
) -> str:
    """The page of one run.

    Args:
        record: Result of ``run_record``.
        checks: The checks of the run.
        cell: Its cell.
        plots: SVG pictures by file name, as ``draw_plots`` returns them; others are ignored.
        view: Where its 3-D page lies from there; empty without one.
    """
    return _render(
        "report.html",
        record,
        cell,
        {
            "figures": key_figures(record),
            "left_out": left_out_notes(record),
            "grips": grip_notes(record),
            "check_groups": _check_groups(checks),
            "shares": _shares(record),
            "excluded": _by_reason(record["exclusions"]),
            "open_surfaces": [line for _, line in open_surface_notes(record["open_surfaces"])],
            "method": list(method_lines(record["solver"], record["step_s"])),
            "plots": _inline_plots(plots),
            "view": view,
        },
    )


def overview_page(record: Record, *, cell: Cell, view: str = "") -> str:
    """The page of several runs, with a link to the page of each.

    Args:
        record: Result of ``summary_record``.
        cell: The cell.
        view: Where the 3-D page lies from there; empty without one.
    """
    parts = {"figures": key_figures(record), "left_out": left_out_notes(record), "grips": grip_notes(record)}
    return _render("overview.html", record, cell, {**parts, "view": view})


def view_beside(place: str) -> str:
    """Where the 3-D page of a run lies, seen from the page in one of its folders, or from its own page."""
    return f"../{VIEW_PAGE}" if place else VIEW_PAGE


def has_view_links(page: str) -> bool:
    """Whether a page of a run leads to its 3-D page."""
    return VIEW_LINKS in page


def rehearsal_page(record: Record, *, cell: Cell, plots: Mapping[str, bytes]) -> str:
    """The page of a rehearsal; ``plots`` as ``draw_rehearsal`` returns them."""
    parts = {"plots": _inline_plots(plots), "executions": EXECUTION_TITLES, "outcomes": OUTCOMES}
    return _render("rehearsal.html", record, cell, parts)


def _render(name: str, record: Record, cell: Cell, parts: Mapping[str, object]) -> str:
    texts = {
        "modes": MODES,
        "classes": CLASSES,
        "narrow": NARROW_FRACTION,
        "fast": FAST_FRACTION,
        "many": len(cell.robots) > MAX_UNFOLDED,
    }
    colours = robot_colours(cell)
    return template(name).render(r=record, colours=colours, ink=ROBOTS[-1], **texts, **parts)


def template(name: str) -> Template:
    """The template of a page by its file name."""
    return _environment().get_template(name)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.bytecode_cache = CompiledTemplates(environment)
    environment.filters |= {
        "fixed": fixed,
        "small": small,
        "power": power,
        "percent": percent,
        "floored": floored,
        "range_bar": range_bar,
        "way_round": direction_text,
        "worst": worst,
    }
    return environment


def _check_groups(checks: Iterable[Check]) -> Entries:
    """Number of checks of each kind and of those that passed, in their order."""
    groups: dict[str, dict[str, Any]] = {}
    for check in checks:
        title = CHECKS.get(check.name, check.name.replace("_", " "))
        group = groups.setdefault(check.name, {"title": title, "count": 0, "passed": 0})
        group["count"] += 1
        group["passed"] += check.passed
    return list(groups.values())


def _shares(record: Record) -> Entries:
    """Fraction of all motion by role."""
    holders = [entry for entry in record["motion_share"].values() if entry["role"] == "positioner"]
    totals = {"positioner": 0.0, "operator": 0.0, "idle": 0.0}
    for entry in record["motion_share"].values():
        totals[entry["role"]] += entry["share"] or 0.0
    names = {
        "positioner": "positioner" if len(holders) < 2 else "positioners",
        "operator": "operators",
        "idle": "robots without a task",
    }
    return [{"name": names[role], "share": share} for role, share in totals.items() if share > 0.0]


def _by_reason(exclusions: Iterable[Record]) -> dict[str, list[str]]:
    """Pairs with reduced requirements, by reason."""
    groups: dict[str, list[str]] = {}
    for exclusion in exclusions:
        groups.setdefault(exclusion["reason"], []).append(" – ".join(exclusion["pair"]))
    return groups


def _inline_plots(plots: Mapping[str, bytes]) -> dict[str, str]:
    """SVG pictures as page content, by file name without its suffix."""
    drawings = {name.removesuffix(".svg"): data for name, data in plots.items() if name.endswith(".svg")}
    return {name: inline_svg(data.decode(), prefix=f"p{i}-") for i, (name, data) in enumerate(drawings.items())}


def inline_svg(text: str, *, prefix: str) -> str:
    """The picture without its file header and with unique ids, so that a page can hold several."""
    body = text[text.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", body, flags=re.DOTALL)
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head) + ' aria-hidden="true" focusable="false"'
    rest = re.sub(r'\bid="', f'id="{prefix}', rest)
    rest = re.sub(r'(url\(|href=")#', rf"\g<1>#{prefix}", rest)
    return f"{head}>{rest}"
