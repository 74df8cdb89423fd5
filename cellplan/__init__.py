"""cellplan: offline programming and cell layout for cooperative robots that work on one moving part.

From a cell file to a verified program, in a few lines::

    from pathlib import Path
    from cellplan import load_cell, solve, write_run
    solution = solve(load_cell("cell.yaml"))
    print(solution)                      # the verdict in one line; a notebook shows figures and pictures
    write_run(solution, Path("outputs/cell"))

The public interface; everything else may change without notice:

- read: ``load_cell``, ``load_errors``
- compute: ``solve``, ``assign``, ``fastest``, ``screen``, ``sweep``, ``compare``, ``base_map``, ``map_study``,
  ``search_layout``, ``repair``, ``rehearse``, ``recover``; ``edit``: the cell live, while its layout is changed
- verify: ``verify``, ``open_gate``
- write: ``write_run``, ``write_assignment``, ``write_fastest``, ``write_base_map``, ``write_rehearsal``,
  ``write_repair``, ``write_recovery``, ``export_program``, ``export_programs``; 3-D pages: ``view``, ``write_view``;
  floor plans: ``requested_floor_plan``, ``write_floor_plan``
- show: ``tables``, ``to_frame``, ``to_html``: results as pandas frames, and in a notebook
- inputs: ``Cell``, ``AssignmentDraft``, ``Robot``, ``Part``, ``Task``, ``Toolpath``, ``Candidates``, ``SweepJob``,
  ``Axis``, ``BaseGrid``, ``CompareJob``, ``LayoutRequest``, ``MapRequest``, ``Stop``, ``ViewRequest``,
  ``FloorPlanRequest``, ``Choice``, ``Moves``
- results: ``Solution``, ``Assignment``, ``ShortestCycles``, ``Motion``, ``Program``, ``Report``, ``Check``,
  ``Screening``, ``LayoutResult``, ``Recovery``, ``Repair``, ``VerifiedRun``, ``Exported``, ``Session``
- errors: ``CellplanError``

All values are frozen data in metres, radians and seconds, with NumPy arrays; frames, pages and files are in mm, deg and
s, with the unit in each name.

Names are imported at first use, so that ``import cellplan`` and the help of the command line are fast.
"""

import os
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from cellplan.model.presented import Presented, Presenter

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # the matrices are small; before numpy is imported, or it has no effect

__version__ = "0.1.0"

if TYPE_CHECKING:
    from cellplan.errors import CellplanError
    from cellplan.files.cell.load import load_cell
    from cellplan.files.cell_errors import load_errors
    from cellplan.jobs.assign.assign import Assignment, assign
    from cellplan.jobs.assign.draft import AssignmentDraft
    from cellplan.jobs.assign.write import write_assignment
    from cellplan.jobs.base_map.base_map import base_map, map_study, write_base_map
    from cellplan.jobs.base_map.grid import BaseGrid
    from cellplan.jobs.base_map.prepared import MapRequest
    from cellplan.jobs.compare.compare import CompareJob, compare
    from cellplan.jobs.fastest.result import write_fastest
    from cellplan.jobs.fastest.shortest import ShortestCycles, fastest
    from cellplan.jobs.floor_plan.floor_plan_file import FloorPlanRequest, requested_floor_plan, write_floor_plan
    from cellplan.jobs.layout.request import LayoutRequest
    from cellplan.jobs.layout.search import LayoutResult, search_layout
    from cellplan.jobs.present.frames import tables, to_frame
    from cellplan.jobs.present.notebook import to_html
    from cellplan.jobs.recover.recover import Recovery, recover
    from cellplan.jobs.recover.result import write_recovery
    from cellplan.jobs.rehearsal.rehearse import rehearse
    from cellplan.jobs.rehearsal.result import write_rehearsal
    from cellplan.jobs.repair.repair import Repair, repair
    from cellplan.jobs.repair.result import write_repair
    from cellplan.jobs.screen import screen
    from cellplan.jobs.sweep.sweep import SweepJob, sweep
    from cellplan.jobs.view.write import ViewRequest, view, write_view
    from cellplan.model.cell.cell import Cell, Part, Robot
    from cellplan.model.motion.motion import Motion, Program
    from cellplan.model.report.exported import Moves
    from cellplan.model.report.report import Check, Report
    from cellplan.model.report.verified_run import VerifiedRun
    from cellplan.model.task.task import Task
    from cellplan.model.task.toolpath import Toolpath
    from cellplan.planning.layout_screening import Candidates, Screening
    from cellplan.programs.export.choice import Choice
    from cellplan.programs.export.program import export_program, export_programs
    from cellplan.programs.export.refusals import Exported
    from cellplan.runs.gate.open_gate import open_gate
    from cellplan.runs.solution import Solution
    from cellplan.runs.solve import solve
    from cellplan.runs.verify import verify
    from cellplan.runs.write_run import write_run
    from cellplan.session.session import Session, edit
    from cellplan.study.study import Stop
    from cellplan.study.variants import Axis

_PUBLIC: Final = {  # names by module
    "errors": "CellplanError",
    "files.cell.load": "load_cell",
    "files.cell_errors": "load_errors",
    "jobs.assign.assign": "Assignment assign",
    "jobs.assign.draft": "AssignmentDraft",
    "jobs.assign.write": "write_assignment",
    "jobs.base_map.base_map": "base_map map_study write_base_map",
    "jobs.base_map.grid": "BaseGrid",
    "jobs.base_map.prepared": "MapRequest",
    "jobs.compare.compare": "CompareJob compare",
    "jobs.fastest.result": "write_fastest",
    "jobs.fastest.shortest": "ShortestCycles fastest",
    "jobs.floor_plan.floor_plan_file": "FloorPlanRequest requested_floor_plan write_floor_plan",
    "jobs.layout.request": "LayoutRequest",
    "jobs.layout.search": "LayoutResult search_layout",
    "jobs.present.frames": "tables to_frame",
    "jobs.present.notebook": "to_html",
    "jobs.recover.recover": "Recovery recover",
    "jobs.recover.result": "write_recovery",
    "jobs.rehearsal.rehearse": "rehearse",
    "jobs.rehearsal.result": "write_rehearsal",
    "jobs.repair.repair": "Repair repair",
    "jobs.repair.result": "write_repair",
    "jobs.screen": "screen",
    "jobs.sweep.sweep": "SweepJob sweep",
    "jobs.view.write": "ViewRequest view write_view",
    "model.cell.cell": "Cell Part Robot",
    "model.motion.motion": "Motion Program",
    "model.report.exported": "Moves",
    "model.report.report": "Check Report",
    "model.report.verified_run": "VerifiedRun",
    "model.task.task": "Task",
    "model.task.toolpath": "Toolpath",
    "planning.layout_screening": "Candidates Screening",
    "programs.export.choice": "Choice",
    "programs.export.program": "export_program export_programs",
    "programs.export.refusals": "Exported",
    "runs.gate.open_gate": "open_gate",
    "runs.solution": "Solution",
    "runs.solve": "solve",
    "runs.verify": "verify",
    "runs.write_run": "write_run",
    "session.session": "Session edit",
    "study.study": "Stop",
    "study.variants": "Axis",
}
_HOME: Final = {name: module for module, names in _PUBLIC.items() for name in names.split()}

# fmt: off
__all__ = [
    "Assignment", "AssignmentDraft", "Axis", "BaseGrid", "Candidates", "Cell", "CellplanError", "Check", "Choice",
    "CompareJob", "Exported", "FloorPlanRequest", "LayoutRequest", "LayoutResult", "MapRequest", "Motion", "Moves",
    "Part", "Program", "Recovery", "Repair", "Report", "Robot", "Screening", "Session", "ShortestCycles", "Solution",
    "Stop", "SweepJob", "Task", "Toolpath", "VerifiedRun", "ViewRequest", "__version__", "assign", "base_map",
    "compare", "edit", "export_program", "export_programs", "fastest", "load_cell", "load_errors", "map_study",
    "open_gate", "recover", "rehearse", "repair", "requested_floor_plan", "screen", "search_layout", "solve", "sweep",
    "tables", "to_frame", "to_html", "verify", "view", "write_assignment", "write_base_map", "write_fastest",
    "write_floor_plan", "write_recovery", "write_rehearsal", "write_repair", "write_run", "write_view",
]
# fmt: on


def __getattr__(name: str) -> Any:
    """Import a public name on first access."""
    if name not in _HOME:
        raise AttributeError(f"module 'cellplan' has no attribute '{name}'")
    return getattr(import_module(f"cellplan.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """The public names, before they are imported too."""
    return sorted({*globals(), *__all__})


def _called(name: str, *arguments: Any) -> Any:
    """Call a public function, which is imported now."""
    return __getattr__(name)(*arguments)


Presented.presenter = Presenter(to_frame=partial(_called, "to_frame"), to_html=partial(_called, "to_html"))
