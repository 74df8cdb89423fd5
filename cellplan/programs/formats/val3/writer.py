"""VAL3 of Staubli: a project for each robot, whose data hold the rows and whose programs move from one to the next."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final, NamedTuple

from cellplan.errors import raise_findings, refusals
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, ProgramRows, Promise
from cellplan.model.units import MM
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.paced import moves_of
from cellplan.programs.elements.pages import (
    PagedProgram,
    paged,
    percentages,
    program_paths,
    render_programs,
    require_six_axes,
)
from cellplan.programs.elements.text import comment, fixed
from cellplan.programs.formats.val3.names import (
    BASE,
    JOINTS,
    MOVE,
    PROJECTS,
    START,
    STOP,
    TOOL,
    WORLD,
    link,
    require_links,
    signal_names,
)
from cellplan.programs.formats.val3.project_text import array_lines, data_text, index_text, program_text
from cellplan.programs.formats.val3.reader import read_val3
from cellplan.programs.formats.val3.seams import (
    SeamWriter,
    libraries,
    require_seams,
    routine_names,
    signal_text,
    tool_values,
    val3_events,
)
from cellplan.programs.formats.val3.seams_reader import read_val3_seams
from cellplan.programs.formats.zones import on_scale, tool_zones

DECIMALS: Final = 5
POSE_DECIMALS: Final = 3
PAGE: Final = 1000  # rows
ZONES: Final = tuple(round(10.0 ** (1.7 + place / 10.0)) for place in range(37))  # [um] of a row, 0.05 to 200 mm
NO_LIMIT: Final = "99999"  # [mm/s] and [deg/s] of the tool: the axes are what limits


class _Move(NamedTuple):
    """How a row is approached and passed."""

    speed: int  # share of the top speed in [%]
    zone: int  # distance of the tool from the row in [um] within which it is rounded, 0 for a stop


def render_val3(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>/<robot>.pjx`` and so on, or ``<robot>/<program>/<program>.pjx``.

    ``InputError`` for a robot without a Staubli controller, that is no arm of six axes alone, lacks a signal, or has a
    position that cannot be written with the decimals.
    """
    paths = program_paths(job.frame, VAL3, PROJECTS)
    raise_findings(refusals(*_demands(job.frame, int)))
    if job.frame.promise is not Promise.PACED:
        return render_programs(job, VAL3, paths, _files)
    files: dict[str, str] = {}
    for (name, robot), path in paths.items():
        files |= _with_seams(job, next(it for it in job.programs if it.name == name), robot, path)
    return files


def _demands(frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    for robot in frame.robots:
        yield partial(require_links, frame, robot)
        yield partial(require_six_axes, frame.robot(robot), external=0, what="VAL3")
        if frame.promise is Promise.PACED:
            yield partial(require_seams, frame, robot)


def _with_seams(job: ExportJob, program: ProgramRows, robot: str, path: str) -> dict[str, str]:
    """All files of a project with seams."""
    project = paged(job, VAL3, program, robot, path)
    names = routine_names(job.frame, robot, project.name)
    seams = SeamWriter(
        frame=job.frame, project=project, moves=moves_of(job, program, val3_events(job.frame, robot)), names=names
    )
    heads = [line for note in project.notes for line in comment(note, "//", forbidden="]")]
    programs = {name: program_text(name, code) for name, code in seams.programs().items() if name != START}
    programs[STOP] = program_text(STOP, ["resetMotion()"])
    programs[START] = program_text(START, [*heads, *seams.programs()[START]])
    texts = {f"{name}.pgx": text for name, text in sorted(programs.items())}
    data = data_text(project.notes, seams.arrays())
    texts = {
        f"{project.name}.pjx": index_text(
            project.name, texts, notes=project.notes, libraries=libraries(job.frame, robot)
        ),
        f"{project.name}.dtx": data,
        **texts,
    }
    return {f"{path}/{file}": text for file, text in texts.items()}


def _files(project: PagedProgram) -> dict[str, str]:
    """All files of a project."""
    q = from_numbers(project.placed, project.numbers)
    zones = on_scale(1000.0 * MM * tool_zones(project.placed, q, project.shares), ZONES).tolist()
    motions = [_Move(*entry) for entry in zip(project.speeds, zones, strict=True)]
    places = {move: place for place, move in enumerate(dict.fromkeys(motions))}  # of the motion descriptors
    signals = signal_names(project.steps)
    pages = [f"{project.name}{ending}" for ending in project.endings]
    programs = {STOP: program_text(STOP, ["resetMotion()"])}
    handshake = [signal_text(step, signals) for step in project.steps]
    moves = [
        _moves(project, page, ending, descriptors=[places[motions[row]] for row in page], handshake=handshake)
        for page, ending in zip(project.pages, project.endings, strict=True)
    ]
    if len(pages) == 1:
        code = moves[0]
    else:
        code = [f"call {page}()" for page in pages]
        programs |= {page: program_text(page, page_moves) for page, page_moves in zip(pages, moves, strict=True)}
    heads = [line for note in project.notes for line in comment(note, "//", forbidden="]")]
    first = [signal_text(step, signals) for step in project.first]
    programs[START] = program_text(START, [*heads, *first, *code, "waitEndMove()"])
    files = {f"{program}.pgx": text for program, text in sorted(programs.items())}
    data = _data(project, places, signals)
    files = {
        f"{project.name}.pjx": index_text(project.name, files, notes=project.notes),
        f"{project.name}.dtx": data,
        **files,
    }
    return {f"{project.path}/{file}": text for file, text in files.items()}


def _data(project: PagedProgram, descriptors: Iterable[_Move], signals: Mapping[tuple[bool, str], str]) -> str:
    """The data: signals, rows, motion descriptors, tool and world frame."""
    lines = array_lines(WORLD, "frame", [{"fatherId": BASE}])
    for (is_input, signal), name in signals.items():
        lines += array_lines(name, "dio", [{"link": link(signal, is_input=is_input)}])
    for page, ending in zip(project.pages, project.endings, strict=True):
        lines += array_lines(f"{JOINTS}{ending}", "jointRx", [_joints(project, row) for row in page])
    lines += array_lines(MOVE, "mdesc", [descriptor(*move) for move in descriptors])
    lines += array_lines(TOOL, "tool", [tool_values(project.placed, POSE_DECIMALS)])
    return data_text(project.notes, lines)


def _joints(project: PagedProgram, row: int) -> dict[str, str]:
    """A row as the attributes of a jointRx."""
    values = project.numbers[row].tolist()
    return {f"j{axis}": fixed(value, project.decimals) for axis, value in enumerate(values, start=1)}


def descriptor(speed: int, zone: int) -> dict[str, str]:
    """A motion at a share of the top speed that ends in a stop, or is left and reached at one distance from its row."""
    shares = {"accel": "100", "vel": str(speed), "decel": "100"}
    size = fixed(zone / 1000.0, 3) if zone else "0"
    blend = {"blend": "joint" if zone else "off", "leave": size, "reach": size}
    return {**shares, "tmax": NO_LIMIT, "rmax": NO_LIMIT, **blend}


def _moves(
    project: PagedProgram, page: range, ending: str, *, descriptors: Sequence[int], handshake: Sequence[str]
) -> list[str]:
    """The motions of a page by their descriptors, and the handshakes after those to its marks."""
    lines, marks = list[str](), set(project.rows.marks)
    for place, (row, descriptor) in enumerate(zip(page, descriptors, strict=True)):
        lines.append(f"movej({JOINTS}{ending}[{place}],{TOOL}[0],{MOVE}[{descriptor}])")
        if row in marks and handshake:
            lines += ["waitEndMove()", *handshake]
    return lines


def _read(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """What the files say, by the reader of lines and arcs where there may be some."""
    read = read_val3_seams if frame.promise is Promise.PACED else read_val3
    return read(frame, files, program_paths(frame, VAL3, PROJECTS))


VAL3: Final[Dialect] = Dialect(
    name="val3",
    title="Staubli VAL3: a project of .pjx, .dtx and .pgx files for each robot",
    render=render_val3,
    read=_read,
    decimals=DECIMALS,
    promises=(Promise.PACED, Promise.SEQUENCE_ONLY),
    moves=tuple(Moves),
    kinds=frozenset({"staubli"}),
    is_thinned=True,
    is_rounded=True,
    split=PAGE,
    speeds=percentages,
    demands=_demands,
)
