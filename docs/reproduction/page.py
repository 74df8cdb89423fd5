"""The page: words from the template, and every published figure beside ours, from the record of what was measured."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from reproduction.listing import listing
from reproduction.page_appendix import drift_rows, sharing_rows
from reproduction.page_joints import joint_rows
from reproduction.page_nicolato import circle_rows, ellipse_rows, limit_rows, line_rows, pose_rows
from reproduction.page_planar import camera_rows, cooperation_rows, planar_rows
from reproduction.page_ribeiro import appendix_rows, layout_rows, main_rows, mode_rows, work_rows
from reproduction.page_servo import servo_rows
from reproduction.page_vargas import case_rows, filter_rows
from reproduction.pages import with_pages
from reproduction.places_in_papers import PLACES
from reproduction.runs import Numbers
from reproduction.sources import line_record, paper_of, source_of, value
from reproduction.verdicts import ALONE, CHOSEN, CIRCULAR, NOT, REPRODUCED, Row, shown

TEMPLATE = Path(__file__).resolve().parent / "template.txt"
HEAD = "| what | where | published | ours | difference | verdict |\n|---|---|---|---|---|---|"
MARK = re.compile(r"\{(?:table:(?P<table>\w+)|value:(?P<value>[\w.]+)|(?P<summary>summary)|(?P<listing>listing))\}")


def page(numbers: Numbers) -> str:
    """The page as Markdown."""
    tables = all_rows(numbers)

    def filled(match: re.Match[str]) -> str:
        if match["table"]:
            return _table(match["table"], tables[match["table"]])
        if match["listing"]:
            return listing()
        return shown(value(numbers, match["value"])) if match["value"] else _summary(tables)

    text = MARK.sub(filled, TEMPLATE.read_text(encoding="utf-8"))
    return text.replace("{{", "{").replace("}}", "}")


def lines(numbers: Numbers) -> list[Numbers]:
    """Every line of the page for machines, in the order of the tables."""
    return [
        line_record(table, row, source_of(PLACES, table, row), numbers)
        for table, rows in all_rows(numbers).items()
        for row in rows
    ]


def _table(name: str, rows: Sequence[Row]) -> str:
    """One table in Markdown."""
    places = [with_pages(paper_of(name), source_of(PLACES, name, row).where) for row in rows]
    return "\n".join([HEAD, *(row.text(place) for row, place in zip(rows, places, strict=True))])


def all_rows(numbers: Numbers) -> dict[str, list[Row]]:
    """The lines of every table by its name in the template."""
    modes, signs = numbers["ribeiro_modes"], numbers["choices"]["signs"]
    return {
        **{f"vargas_{case}": case_rows(case, numbers[f"vargas_{case}"], signs) for case in (1, 2, 3)},
        "vargas_filter": filter_rows(numbers["vargas_filter"]),
        "nicolato_circle": circle_rows(numbers["nicolato_circle"]),
        "nicolato_line": line_rows(numbers["nicolato_line"]),
        "nicolato_limits": limit_rows(numbers["nicolato_limits"]),
        "nicolato_ellipse": ellipse_rows(numbers["nicolato_ellipse"]),
        "nicolato_pose": pose_rows(numbers["nicolato_pose"]),
        "nicolato_planar": planar_rows(numbers["nicolato_planar"]),
        "nicolato_camera": camera_rows(numbers["nicolato_planar"]),
        "nicolato_servo": servo_rows(numbers["nicolato_servo"]),
        "nicolato_cooperation": cooperation_rows(numbers["nicolato_cooperation"]),
        "ribeiro_main": main_rows(modes),
        "ribeiro_errors": mode_rows(modes),
        "ribeiro_work": work_rows(modes),
        "ribeiro_joints": joint_rows(modes),
        "ribeiro_first_layout": layout_rows(numbers["ribeiro_first_layout"]),
        "ribeiro_appendix_e": appendix_rows(numbers["ribeiro_appendix_e"]),
        "ribeiro_appendix_d": drift_rows(numbers["ribeiro_appendix_d"]),
        "ribeiro_load_sharing": sharing_rows(numbers["ribeiro_load_sharing"]),
    }


def _summary(tables: Mapping[str, Sequence[Row]]) -> str:
    """How many lines there are of each verdict."""
    rows = [row for table in tables.values() for row in table]
    counts = {
        verdict.strip("*"): sum(row.verdict == verdict for row in rows)
        for verdict in (REPRODUCED, NOT, CHOSEN, CIRCULAR, ALONE)
    }
    return f"Of {len(rows)} lines: {', '.join(f'{count} {verdict}' for verdict, count in counts.items())}."
