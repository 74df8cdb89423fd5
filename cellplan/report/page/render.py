"""``report.html``: verdict and evidence of a run as one self-contained page."""

import importlib.util
import sys
import zlib
from base64 import b64encode
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Annotated, Final, TypedDict, Unpack
from urllib.parse import quote

import jinja2
from jinja2 import Environment, FileSystemBytecodeCache, FileSystemLoader, StrictUndefined, Template
from jinja2.bccache import Bucket

from cellplan.model.cell.cell import Cell
from cellplan.report.page.checks import check_groups, failure_groups
from cellplan.report.page.figures import key_figures, phase_errors
from cellplan.report.page.first_screen import MAX_SPEEDS, not_judged, process_speeds, worst_instant
from cellplan.report.page.time_line import task_times, time_line
from cellplan.report.page.times import TimeLinks, page_begin, phase_begins
from cellplan.report.plots.palette import ROBOTS, dark_rules, robot_colours
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.numbers import against, fixed, floored, percent, power, range_bar, small, stated, worst
from cellplan.report.record.phases import is_of_phase
from cellplan.report.record.sections.clearance import CLASSES
from cellplan.report.record.sections.tasks import direction_text
from cellplan.report.text.method import method_lines
from cellplan.report.text.notes import grip_notes, left_out_notes, open_surface_notes

Links = list[tuple[str, str]]  # text and address
TABLES: Final = {"tables": "Joint tables", "rejected": "Joint tables of a failed run, not for use"}
STILL: Final = "still.svg"  # picture of the worst instant, beside the page
FLOOR_PLAN: Final = "floor_plan.svg"  # likewise
VIEW_PAGE: Final = "view.html"  # the 3-D page in a run folder
MODES: Final = {
    "simultaneous": "all robots move",
    "pairwise": "the positioner and one operator move at a time",
    "part_at_rest": "the positioner is at rest",
    "semi_coordinated": "the positioner moves between tasks and is at rest during them",
}
MAX_UNFOLDED: Final = 8  # robots; with more, pictures and long lists are folded
NARROW_FRACTION: Final = 0.05  # [-] fraction of the half range: smaller margins are marked
FAST_FRACTION: Final = 0.95  # [-] fraction of the speed limit: higher speeds are marked
SCRIPTS: Final = ("page.js", "figures.js")
TEMPLATES: Final = Path(__file__).resolve().parent / "templates"
# the template of a kind of result stands beside its job: jobs/fastest/fastest.html
PACKAGE: Final = TEMPLATES.parents[2]
OPTIONS: Final = ("autoescape", "trim_blocks", "lstrip_blocks", "keep_trailing_newline", "optimized")


def file_links(
    tables: Collection[str], plots: Iterable[str], files: Iterable[str], *, phase: str | None
) -> dict[str, Links]:
    """Links to the files of a run by what they are.

    Args:
        tables: Names of the joint tables in the run folder.
        plots: Names of the plots in the folder of the page.
        files: Names of other files in that folder.
        phase: Phase of the page, which lies in a folder of its own; None for the page in the run folder.
    """
    up = _up(phase)
    groups = {title: _tables(tables, folder, up) for folder, title in TABLES.items()}
    of_the_run = [(name, f"{up}{name}") for name in ("cell.yaml", "manifest.json")]
    groups["Results"] = [*((name, name) for name in files), *of_the_run]
    groups["Plots"] = [(PurePosixPath(name).stem.replace("_", " "), f"plots/{quote(name)}") for name in plots]
    return {title: links for title, links in groups.items() if links}


def _up(phase: str | None) -> str:
    """The way from the folder of a page to the run folder, to be put before a name."""
    return "../" if phase is not None else ""


def _tables(files: Collection[str], folder: str, up: str) -> Links:
    names = sorted(name for name in files if PurePosixPath(name).parent == PurePosixPath(folder))
    return [(PurePosixPath(name).stem, f"{up}{quote(name)}") for name in names]


class PageFiles(TypedDict, total=False):
    """What lies beside a page, and the pictures in it; what is left out is empty."""

    still: Annotated[
        str, "picture of `worst_instant(record)` as the text of an SVG element; `still.svg` lies beside it"
    ]
    floor_plan: Annotated[str, "floor plan, likewise; `floor_plan.svg`"]
    files: Annotated[Collection[str], "names of the joint tables in the run folder, as `tables/kuka.csv`"]


def report_page(record: Record, *, cell: Cell, plots: Mapping[str, bytes], **pictures: Unpack[PageFiles]) -> str:
    """The page of a program, or of one of its phases; that of several phases leads to the page of each.

    Args:
        plots: SVG pictures by file name, which lie in ``plots/`` beside the page; others are ignored.
        **pictures: What lies beside it, and its pictures.
    """
    several = not is_of_phase(record)
    parts: dict[str, object] = {"errors": phase_errors(record)} if several else _phase_parts(record, cell)
    view, begins = f"{_up(record.get('phase'))}{VIEW_PAGE}", phase_begins(record)
    parts |= {
        "several": several,
        "figures": key_figures(record),
        "failures": failure_groups(record),
        "check_groups": check_groups(record),
        "speeds": process_speeds(record, cell),
        "most_speeds": MAX_SPEEDS,
        "not_judged": not_judged(record),
        "left_out": left_out_notes(record),
        "grips": grip_notes(record),
        "open_surfaces": [line for _, line in open_surface_notes(record["open_surfaces"])],
        "begins": begins,
        "worst": worst_instant(record),
        "line": time_line(record, cell),
        "at": TimeLinks(view, page_begin(record), begins),
        "view": view,
        "still": svg_element(pictures.get("still", "")),
        "floor_plan_svg": svg_element(pictures.get("floor_plan", "")),
        "plots": inline_plots(plots),
        "links": _links(record, [name for name in plots if name.endswith(".svg")], pictures),
    }
    return cell_page("report.html", record, cell, parts)


def _phase_parts(record: Record, cell: Cell) -> dict[str, object]:
    """What only the page of one phase shows."""
    return {
        "shares": _shares(record),
        "of_links": _by_reason(_of_links(record)),
        "method": list(method_lines(record["solver"], record["step_s"])),
        "task_times": task_times(record, cell),
    }


def _links(record: Record, plots: Iterable[str], pictures: PageFiles) -> dict[str, Links]:
    names = ["report.json", "series.json"] if is_of_phase(record) else ["report.json"]
    names += [name for name, text in ((STILL, pictures.get("still")), (FLOOR_PLAN, pictures.get("floor_plan"))) if text]
    return file_links(pictures.get("files", ()), plots, names, phase=record.get("phase"))


def cell_page(name: str, record: Record, cell: Cell, parts: Mapping[str, object]) -> str:
    """The page of something that was done with a cell.

    Args:
        parts: What else it shows, by the names in the template.
    """
    texts = {
        "modes": MODES,
        "classes": {"whole": "whole cell", **CLASSES},
        "narrow": NARROW_FRACTION,
        "fast": FAST_FRACTION,
        "many": len(cell.robots) > MAX_UNFOLDED,
    }
    colours = robot_colours(cell)
    return template(name).render(r=record, colours=colours, ink=ROBOTS[-1], **texts, **parts)


def template(name: str) -> Template:
    """The template of a page by its path, in ``templates`` or in the package."""
    return _environment().get_template(name)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader((TEMPLATES, PACKAGE)),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.bytecode_cache = CompiledTemplates(environment)
    environment.filters |= {
        "fixed": fixed,
        "small": small,
        "stated": stated,
        "against": against,
        "power": power,
        "percent": percent,
        "floored": floored,
        "range_bar": range_bar,
        "way_round": direction_text,
        "worst": worst,
    }
    environment.globals["dark_rules"] = dark_rules
    environment.globals["scripts"] = page_scripts(environment.get_template(name).render() for name in SCRIPTS)
    return environment


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


def _of_links(record: Record) -> Entries:
    """Pairs with reduced requirements that are not among those that were not judged in full: links of one robot."""
    named = {frozenset(entry["bodies"]) for entry in record["left_out"]}
    return [exclusion for exclusion in record["exclusions"] if frozenset(exclusion["pair"]) not in named]


def _by_reason(exclusions: Iterable[Record]) -> dict[str, list[str]]:
    """Pairs with reduced requirements, by reason."""
    groups: dict[str, list[str]] = {}
    for exclusion in exclusions:
        groups.setdefault(exclusion["reason"], []).append(" – ".join(exclusion["pair"]))
    return groups


def inline_plots(plots: Mapping[str, bytes]) -> dict[str, str]:
    """SVG pictures as page content, by file name without its suffix."""
    drawings = {name.removesuffix(".svg"): data for name, data in plots.items() if name.endswith(".svg")}
    return {name: inline_svg(data.decode()) for name, data in drawings.items()}


def svg_element(text: str) -> str:
    """An SVG element without what a file may have before it."""
    return text[text.index("<svg") :] if text else ""


@dataclass(frozen=True, slots=True)
class PageScripts:
    """Scripts as they stand in a page."""

    texts: tuple[str, ...]  # what stands between the tags, one text for each
    policy: str  # the sources of scripts that its content security policy allows: these, and no others


def page_scripts(texts: Iterable[str]) -> PageScripts:
    """Scripts with the policy that allows them.

    A browser compares the digest with the text between the tags to the byte, so that a script that was changed or
    added does not run; see https://www.w3.org/TR/CSP3/#match-element-to-source-list.
    """
    scripts = tuple(texts)
    digests = (b64encode(sha256(text.encode()).digest()).decode() for text in scripts)
    return PageScripts(scripts, " ".join(f"'sha256-{digest}'" for digest in digests))


class CompiledTemplates(FileSystemBytecodeCache):
    """Keeps compiled templates in the folder ``__pycache__`` beside them, or below ``PYTHONPYCACHEPREFIX``.

    A template is compiled again when its text, the release of Python or of jinja2, or the options of the environment
    have changed. Where nothing can or may be written, it is compiled by each process.
    """

    def __init__(self, environment: Environment) -> None:
        """Prepare."""
        options = {name: getattr(environment, name) for name in OPTIONS}
        release = zlib.crc32(f"{jinja2.__version__} {options} {sorted(environment.extensions)}".encode())
        module = importlib.util.cache_from_source(str(TEMPLATES / "page.py"))
        super().__init__(str(Path(module).parent), f"%s.{sys.implementation.cache_tag}.{release:08x}.template")

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill in what is kept of a template, unless something is wrong with it."""
        try:
            super().load_bytecode(bucket)
        except Exception:  # noqa: BLE001 - a damaged file is made again
            bucket.reset()

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep a compiled template."""
        if sys.dont_write_bytecode:
            return
        with suppress(OSError):
            Path(self.directory).mkdir(parents=True, exist_ok=True)
            super().dump_bytecode(bucket)
