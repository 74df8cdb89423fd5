"""Files of a layout search: ``study.json`` and ``study.html``."""

from cellplan.model.report import CAUTION
from cellplan.report.page.render import template
from cellplan.report.plots.layout import convergence_figure, floor_plan, front_figure
from cellplan.report.plots.svg import inline_svg, svg_text
from cellplan.report.record.common import Record, as_json
from cellplan.report.text.layout import changed_variables, path_text, verdict_line


def layout_files(record: Record) -> dict[str, bytes]:
    """Content of the files of a layout search by name.

    Args:
        record: As ``layout_record`` returns it.
    """
    return {"study.json": as_json(record).encode(), "study.html": layout_page(record).encode()}


def layout_page(record: Record) -> str:
    """The page of a layout search.

    Args:
        record: As ``layout_record`` returns it.
    """
    drawn = {"plan": floor_plan(record), "front": front_figure(record), "convergence": convergence_figure(record)}
    plots = {name: inline_svg(svg_text(figure)) for name, figure in drawn.items() if figure is not None}
    return template("layout.html").render(
        r=record,
        plots=plots,
        verdict=verdict_line(record),
        changed=changed_variables(record),
        path="" if record["path"] is None else path_text(record["path"]),
        caution=CAUTION,
    )
