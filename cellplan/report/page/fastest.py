"""``fastest.html``: the shortest cycles of a cell and its production curve as one self-contained page."""

from collections.abc import Mapping
from typing import Final

from cellplan.model.report import CAUTION
from cellplan.report.page.figures import figure
from cellplan.report.page.render import template
from cellplan.report.plots.fastest import COLOURS, SHOWN, curve_figures, curves_of, single_programs
from cellplan.report.plots.svg import inline_svg, svg_text
from cellplan.report.record.common import Entries, Record
from cellplan.report.text.fastest import TITLES, binding_lines, saving_text

NAMES: Final = {**TITLES, "demand": "for the demand"}
SINGLES: Final = (NAMES["reduced_speed"], NAMES["demand"])  # beside the curve


def fastest_page(record: Record) -> str:
    """The page of the shortest cycles.

    Args:
        record: As ``fastest_record`` returns it.
    """
    drawn = curve_figures(record)
    plots = [{"title": SHOWN[name].title, "svg": inline_svg(svg_text(figure))} for name, figure in drawn.items()]
    legend = [*curves_of(record), *single_programs(record)] if drawn else []
    programs = _programs(record)
    return template("fastest.html").render(
        r=record,
        figures=_figures(programs),
        programs=programs,
        singles={title: each for title, each in programs.items() if title in SINGLES},
        plots=plots,
        legend=[(COLOURS[law], NAMES[law]) for law in legend],
        titles=TITLES,
        saving=saving_text,
        binding=binding_lines,
        caution=CAUTION,
    )


def _programs(record: Record) -> dict[str, Record]:
    """Every program by its title."""
    found = {NAMES[name]: program for name, program in record["cycles"].items()}
    if record["demand"]:
        found[NAMES["demand"]] = record["demand"]["program"]
    return found


def _figures(programs: Mapping[str, Record]) -> Entries:
    """The cycle times at the top of the page."""
    entries: Entries = []
    for name, program in programs.items():
        per_hour, binding = f"{program['figures']['parts_per_h']:.1f} parts per hour", binding_lines(program)
        note = f"{per_hour}; {binding[0]}" if len(binding) == 1 else per_hour
        is_bad = program["status"] != "passed"
        entries.append(figure(name, f"{program['cycle_s']:g}", "s", note=note, is_bad=is_bad))
    return entries
