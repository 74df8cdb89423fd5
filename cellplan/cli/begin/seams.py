"""``cellplan seams``: edges, seams and faces of a STEP file, with tasks to paste."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.request import Options, argument, option
from cellplan.cli.terminal.output import say, say_json, show


@dataclass(frozen=True, slots=True, kw_only=True)
class SeamsOptions(Options):
    """Which part is listed, and where its page is written."""

    SCHEMA = "cellplan.seams/1"

    path: Annotated[Path, argument("PART", "STEP file.")]
    fillets: Annotated[bool, option("--fillets", "List fillets only: concave edges and seams.")] = False
    gap_mm: Annotated[
        float,
        option("--gap-mm MM", "Join solids that are no farther apart by seams (default: 0, they touch).", min=0, max=5),
    ] = 0.0
    shape: Annotated[
        str | None, option("--shape NAME", "List this assembly, part or solid of the file (default: all).")
    ] = None
    output: Annotated[Path | None, option("-o, --output FILE", "Also write a 3-D page with all names.")] = None
    as_json: shared.AsJson = False


def seams(options: SeamsOptions) -> None:
    """List the edges, seams and faces of a STEP file, and tasks on them to paste into a cell.

    A seam is where an edge of one solid lies on a face of another. Names are those of the file, or numbers. It needs
    the package cadquery-ocp-novtk, as pip install 'cellplan[step]' brings it. Exit status: 0 listed, 2 bad input.
    """
    from cellplan.jobs.step_seams.listing import SeamsRequest, list_seams, seams_lines, seams_record

    request = SeamsRequest(path=options.path, shape=options.shape, gap_mm=options.gap_mm, fillets=options.fillets)
    listing = list_seams(request)
    size = 0
    if options.output is not None:
        from cellplan.jobs.step_seams.page import write_seams_page

        size = write_seams_page(listing, request, options.output)
    if options.as_json:
        say_json(seams_record(listing, request))
        return
    show(list(seams_lines(listing, request)))
    if options.output is not None:
        say(f"page: {options.output} ({size / 1e3:.0f} kB)")
