"""Texts of the page of the live cell by their addresses; none of them holds anything of a cell."""

from typing import Final

from cellplan.jobs.view.result import SCRIPTS as VIEW_SCRIPTS
from cellplan.report.page.render import PACKAGE, template

VIEW: Final = "jobs/view/page"  # below the package
EDIT: Final = "cli/edit/page"
OF_FILES: Final = frozenset({"bases", "start"})  # scripts of the view page that only pages in files need
_SCRIPTS: Final = "client fields motions handles overlay figures outcome live begin"
SCRIPTS: Final = _SCRIPTS.split()  # each after those that it needs


def page_texts() -> dict[str, tuple[str, str]]:
    """Media type and text of all that a browser loads, by address; the page allows no script or style beyond these."""
    places = [f"{VIEW}/scripts/{name}.js" for name in VIEW_SCRIPTS if name not in OF_FILES]
    places += [f"{EDIT}/scripts/{name}.js" for name in SCRIPTS]
    return {
        "/": ("text/html", template(f"{EDIT}/edit.html").render()),
        "/edit.js": ("text/javascript", '"use strict";\n' + _joined(places)),
        "/edit.css": ("text/css", _joined([f"{VIEW}/view.css", f"{EDIT}/edit.css"])),
    }


def _joined(places: list[str]) -> str:
    """The texts of some files of the package, one after the other."""
    return "\n".join((PACKAGE / place).read_text(encoding="utf-8") for place in places)
