"""``cellplan view``: the cell in motion, as one page that opens in a browser."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import cell_files
from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, Settings
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.view/1"

Shown = Annotated[
    Path,
    typer.Argument(
        metavar="RUN|CELL|STUDY", help="Run folder, cell file, or study of cellplan layout.", autocompletion=cell_files
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="The page (default: RUN/view.html, STUDY/study-view.html, or outputs/<cell name>-view.html).",
    ),
]


def view(  # noqa: PLR0913, PLR0917 - the options of the command
    path: Shown,
    output: Output = None,
    cell: OriginalCell = None,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Write a 3-D page: one file without a network or a server, which plays a run in a browser.

    Of a run it shows the whole motion, the closest pair and every failure at its instant; of a cell that was not solved
    its start, with the bases to move; of a layout search its best layouts. Exit status: 0 the page was written,
    whatever it shows, 2 bad input, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.pipeline.view.write import ViewRequest, write_view
        from cellplan.pipeline.view.write import view as view_record

        request = ViewRequest(path=path, output=output, cell=cell, settings=settings or (), allow_dirs=allow_dir or ())
        with progress_listener(quiet=quiet) as progress:
            record, target = view_record(request, progress=progress)
        size = write_view(record, target)
    failures = [failure["text"] for scene in record["scenes"][:1] for failure in scene["failures"]]
    if as_json:
        about = {"kind": record["kind"], "cell": record["cell"], "page": str(target), "bytes": size}
        say_json({"schema": SCHEMA, "status": "written", "exit": int(ExitStatus.PASSED), **about, "failures": failures})
        return
    shown = [f"  shows: {failure}" for failure in failures] if record["kind"] != "study" else []
    show([f"{record['cell']}: {target} ({size / 1e6:.1f} MB)", *shown, f"open {target} in a browser"])
