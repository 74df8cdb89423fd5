"""The scenes of a layout search: its best layouts, one after the other, each with the motion that it gives."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.load import load_cell
from cellplan.files.input.files import read_regular_file
from cellplan.files.input.findings import shown
from cellplan.files.input.json_reader import parse_json, required
from cellplan.geometry.shapes import HalfSpace
from cellplan.jobs.layout.record import SCHEMA
from cellplan.jobs.layout.result_file import BEST
from cellplan.jobs.view.cell_scene import standing_scene
from cellplan.jobs.view.geometries import Geometries, shape_key
from cellplan.jobs.view.nearest import ViewedStretch, nearest_record, sampled_rows
from cellplan.jobs.view.run_scene import motion_record
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths
from cellplan.report.record.common import Record
from cellplan.runs.plan.run import plan_run
from cellplan.scene.bodies import is_ground, scene_bodies
from cellplan.scene.collision.bodies import prepare
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene
from cellplan.study.folder import RESULT

ROWS: Final = 500  # [-] of the motion of each layout
DISTANCES: Final = 50  # [-] rows of it at which the closest pair is looked for
RESULT_LIMIT: Final = 200_000_000  # [bytes]
FIGURES: Final = (
    ("cycle_s", "cycle", "s"),
    ("margin_deg", "smallest margin", "deg"),
    ("clearance_mm", "smallest clearance", "mm"),
    ("change", "change", ""),
)


def read_layout_study(folder: Path) -> Record:
    """The result of a layout search; a study without one, or of another kind, is refused."""
    file = folder / RESULT
    if not file.exists():
        raise InputError(f"{file}: missing: the search has not ended; finish it with --resume")
    record = parse_json(read_regular_file(file, file=str(file), limit=RESULT_LIMIT), str(file))
    if record.get("schema") != SCHEMA or record.get("kind") != "layout":
        got = f"one of the kind {shown(record.get('kind', 'unknown'))}"
        raise InputError(f"{file}: expected the study of a layout search, got {got}: view one of its runs instead")
    required(record, "top", list, file=str(file))
    return record


def cell_of_study(folder: Path, given: Path | None, allow_dirs: Sequence[Path]) -> Cell:
    """The cell that the layouts are made of: the given one, else the best layout in the folder; one must be there."""
    path = folder / BEST if given is None else given
    if given is None and not path.exists():
        raise InputError(f"{folder}: expected {BEST} in it, got none: no layout passed; name the cell file with --cell")
    return load_cell(path, allow_dirs=allow_dirs)


def study_scenes(record: Record, cell: Cell, file: str, geometries: Geometries, progress: Progress) -> Iterator[Record]:
    """A scene for each of the best layouts."""
    top: list[Any] = record["top"]
    first: Scene | None = None
    for place, layout in enumerate(top):
        progress("planning the layouts", place / len(top))
        settings = required(layout, "settings", dict, file=file)
        try:
            scene = placed_scene(first, cell.with_values(settings))
        except InputError as error:
            raise InputError(f"{file}: top[{place}].settings: {str(error).splitlines()[0]}") from None
        first = first or scene
        shown = _moving(standing_scene(scene, geometries), scene)
        yield {
            **shown,
            "name": f"{place + 1} of {len(top)}: trial {layout['trial']}, {layout['status']}",
            "facts": [*_facts(layout), *shown["facts"]],
            "remarks": [*shown["remarks"], *([layout["reason"]] if layout["reason"] else [])],
            "passed": layout["status"] == "certified" or None,
        }


def placed_scene(first: Scene | None, cell: Cell) -> Scene:
    """The scene of a layout, as far as a picture needs it: pairs are sorted, and tools cut, for the first one only.

    Args:
        first: The scene of another layout of the same cell; None for the first one.
    """
    bodies = tuple(sorted(scene_bodies(cell), key=is_ground))
    if first is None or [body.name for body in bodies] != [body.name for body in first.bodies]:
        return Scene.from_cell(cell)
    made = {
        index: prepare(body.name, body.shape)
        for index, (body, old) in enumerate(zip(bodies, first.bodies, strict=True))
        if not isinstance(body.shape, HalfSpace) and shape_key(body.shape) != shape_key(old.shape)
    }
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    return replace(first, cell=cell, chains=chains, bodies=bodies, engine=first.engine.with_bodies(made))


def _moving(standing: Record, scene: Scene) -> Record:
    """The scene with the motion that the layout has at the duration of the cell; as it stands where there is none."""
    cell = scene.cell
    phases = plan_phases(cell).program
    if cell.program.is_home_to_home or len(phases) > 1 or any(robot.start is None for robot in cell.robots):
        return standing
    try:
        paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
        motion = plan_run(cell, paths, phases[0]).motion
    except (InputError, NoSolutionError) as error:
        return {**standing, "remarks": [*standing["remarks"], f"shown at its start: {error}"]}
    rows = sampled_rows(motion.times, (), ROWS)
    times, q = motion.times[rows], motion.q[rows]
    every = sampled_rows(times, (), DISTANCES)
    return {
        **standing,
        "facts": [["shown at", f"{times[-1]:.4g} s"], ["motion", "planned for this page, not verified"]],
        "motion": motion_record(times, q, []),
        "nearest": nearest_record([ViewedStretch(scene, 0, len(times))], times, q, every),
    }


def _facts(layout: Record) -> list[list[str]]:
    """The figures of a layout."""
    facts = [["from", str(layout["origin"])]]
    for key, label, unit in FIGURES:
        if layout[key] is not None:
            facts.append([label, f"{layout[key]:.4g} {unit}".strip()])
    return facts
