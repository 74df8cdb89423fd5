"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

CellFile = Annotated[Path, typer.Argument(metavar="CELL", help="Cell file (YAML).", show_default=False)]
RunDir = Annotated[Path, typer.Argument(metavar="RUN", help="Run folder.", show_default=False)]
OriginalCell = Annotated[
    Path | None,
    typer.Option(
        "--cell", metavar="CELL", help="The cell file that was solved: it and its files are compared with the run."
    ),
]
AllowDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--allow-dir",
        metavar="DIR",
        help="Also read files below this folder; may be repeated.",
        show_default=False,
        exists=True,
        file_okay=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]
