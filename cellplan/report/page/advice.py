"""Page of a repair: ``advice.html``."""

from pathlib import Path

from cellplan.model.report import CAUTION
from cellplan.report.page.render import template
from cellplan.report.record.common import Record
from cellplan.report.text.advice import command_line, demands_text, tried_groups, verdict_line


def advice_page(record: Record) -> str:
    """The page of a repair.

    Args:
        record: As ``advice_record`` returns it.
    """
    return template("advice.html").render(
        r=record,
        verdict=verdict_line(record),
        demands=demands_text(record),
        commands=[command_line(each, Path(record["file"])) for each in record["remedies"]],
        tried=tried_groups(record),
        caution=CAUTION,
    )
