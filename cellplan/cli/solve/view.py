"""``cellplan view``: the cell in motion, as one page that opens in a browser."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import cell_files
from cellplan.cli.options.request import argument, option
from cellplan.cli.terminal.output import Result
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewOptions(shared.JobOptions):
    """What is shown, and where it is written."""

    SCHEMA = "cellplan.view/1"

    path: Annotated[
        Path,
        argument("RUN|CELL|STUDY", "Run folder, cell file, or study of cellplan layout.", autocompletion=cell_files),
    ]
    output: Annotated[
        Path | None,
        option(
            "-o, --output FILE",
            "The page (default: RUN/view.html, STUDY/study-view.html, or outputs/<cell name>-view.html).",
        ),
    ] = None
    cell: shared.OriginalCell = None
    settings: shared.Settings = ()


def view(options: ViewOptions) -> Result:
    """Write a 3-D page: one file without a network or a server, which plays a run in a browser.

    Of a run it shows the whole motion, the closest pair and every failure at its instant; of a cell that was not solved
    its start, with the bases to move; of a layout search its best layouts. Exit status: 0 the page was written,
    whatever it shows, 2 bad input, 4 internal error.
    """
    from cellplan.jobs.view.write import ViewRequest, write_view
    from cellplan.jobs.view.write import view as view_record

    with progress_listener(quiet=options.quiet) as progress:
        record, target = view_record(options.to(ViewRequest), progress=progress)
    size = write_view(record, target)
    failures = [failure["text"] for scene in record["scenes"][:1] for failure in scene["failures"]]
    about = {"schema": options.schema, "status": "written", "exit": int(ExitStatus.PASSED), "kind": record["kind"]}
    what = {"cell": record["cell"], "page": str(target), "bytes": size, "failures": failures}
    shown = [f"  shows: {failure}" for failure in failures] if record["kind"] != "study" else []
    lines = [f"{record['cell']}: {target} ({size / 1e6:.1f} MB)", *shown, f"open {target} in a browser"]
    return Result(ExitStatus.PASSED, lines, {**about, **what}, is_verdict=False)
