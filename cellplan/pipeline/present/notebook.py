"""Results as a notebook shows them."""

from cellplan.pipeline.present.cards import card_of
from cellplan.report.page.notebook import card_html


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
