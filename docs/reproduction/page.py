"""The page: words from the template, and every published figure beside ours, from the record of what was measured."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reproduction.page_nicolato import circle_rows, ellipse_rows, limit_rows, line_rows, pose_rows
from reproduction.page_ribeiro import appendix_rows, layout_rows, main_rows, mode_rows, work_rows
from reproduction.page_vargas import case_rows
from reproduction.runs import Numbers
from reproduction.verdicts import ALONE, CHOSEN, NOT, REPRODUCED, Row, shown

TEMPLATE = Path(__file__).resolve().parent / "template.txt"
HEAD = "| what | published | ours | difference | verdict |\n|---|---|---|---|---|"
MARK = re.compile(r"\{(?:table:(?P<table>\w+)|value:(?P<value>[\w.]+)|(?P<summary>summary))\}")


def page(numbers: Numbers) -> str:
    """The page as Markdown."""
    tables = all_rows(numbers)

    def filled(match: re.Match[str]) -> str:
        if match["table"]:
            return "\n".join([HEAD, *(row.text() for row in tables[match["table"]])])
        return shown(_value(numbers, match["value"])) if match["value"] else _summary(tables)

    text = MARK.sub(filled, TEMPLATE.read_text(encoding="utf-8"))
    return text.replace("{{", "{").replace("}}", "}")


def all_rows(numbers: Numbers) -> dict[str, list[Row]]:
    """The lines of every table by its name in the template."""
    modes = numbers["ribeiro_modes"]
    return {
        **{f"vargas_{case}": case_rows(case, numbers[f"vargas_{case}"]) for case in (1, 2, 3)},
        "nicolato_circle": circle_rows(numbers["nicolato_circle"]),
        "nicolato_line": line_rows(numbers["nicolato_line"]),
        "nicolato_limits": limit_rows(numbers["nicolato_limits"]),
        "nicolato_ellipse": ellipse_rows(numbers["nicolato_ellipse"]),
        "nicolato_pose": pose_rows(numbers["nicolato_pose"]),
        "ribeiro_main": main_rows(modes),
        "ribeiro_errors": mode_rows(modes),
        "ribeiro_work": work_rows(modes),
        "ribeiro_first_layout": layout_rows(numbers["ribeiro_first_layout"]),
        "ribeiro_appendix_e": appendix_rows(numbers["ribeiro_appendix_e"]),
    }


def _summary(tables: Mapping[str, Sequence[Row]]) -> str:
    """How many lines there are of each verdict."""
    rows = [row for table in tables.values() for row in table]
    counts = {
        verdict.strip("*"): sum(row.verdict == verdict for row in rows) for verdict in (REPRODUCED, NOT, CHOSEN, ALONE)
    }
    return f"Of {len(rows)} lines: {', '.join(f'{count} {verdict}' for verdict, count in counts.items())}."


def _value(numbers: Numbers, path: str) -> float:
    """One number of the record."""
    found: Any = numbers
    for name in path.split("."):
        found = found[name]
    return float(found)
