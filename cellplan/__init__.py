"""cellplan: offline programming and cell layout for cooperative robots that work on one moving part.

From a cell file to a verified program, in a few lines::

    from pathlib import Path
    from cellplan import load_cell, solve, write_run
    solution = solve(load_cell("cell.yaml"))
    print(solution)                      # the verdict in one line; a notebook shows figures and pictures
    write_run(solution, Path("outputs/cell"))

The public interface; everything else may change without notice:

- read: ``load_cell``, ``load_errors``
- compute: ``solve``, ``fastest``, ``screen``, ``sweep``, ``compare``, ``base_map``, ``map_study``,
  ``search_layout``, ``repair``, ``rehearse``, ``recover``
- verify: ``verify``, ``open_gate``
- write: ``write_run``, ``write_fastest``, ``write_base_map``, ``write_rehearsal``, ``write_repair``,
  ``write_recovery``, ``export_program``, ``export_programs``; 3-D pages: ``view``, ``write_view``; floor plans:
  ``requested_floor_plan``, ``write_floor_plan``
- show: ``tables``, ``to_frame``, ``to_html``: results as pandas frames, and in a notebook
- inputs: ``Cell``, ``Robot``, ``Part``, ``Task``, ``Toolpath``, ``Candidates``, ``SweepJob``, ``Axis``, ``BaseGrid``,
  ``CompareJob``, ``LayoutRequest``, ``MapRequest``, ``Stop``, ``ViewRequest``, ``FloorPlanRequest``, ``Choice``
- results: ``Solution``, ``ShortestCycles``, ``Motion``, ``Program``, ``Report``, ``Check``, ``Screening``,
  ``LayoutResult``, ``Recovery``, ``Repair``, ``VerifiedRun``, ``Exported``
- errors: ``CellplanError``

All values are frozen data in metres, radians and seconds, with NumPy arrays; frames, pages and files are in mm, deg and
s, with the unit in each name.

Names are imported at first use, so that ``import cellplan`` and the help of the command line are fast.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Final

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # the matrices are small; before numpy is imported, or it has no effect

__version__ = "0.1.0"

if TYPE_CHECKING:
    from cellplan.errors import CellplanError
    from cellplan.io.cell.load import load_cell
    from cellplan.io.cell_errors import load_errors
    from cellplan.model.cell import Cell, Part, Robot
    from cellplan.model.motion import Motion, Program
    from cellplan.model.report import Check, Report
    from cellplan.model.task import Task
    from cellplan.model.toolpath import Toolpath
    from cellplan.model.verified_run import VerifiedRun
    from cellplan.pipeline.base_map.grid import BaseGrid
    from cellplan.pipeline.base_map.judged import base_map, write_base_map
    from cellplan.pipeline.base_map.prepared import MapRequest
    from cellplan.pipeline.base_map.study import map_study
    from cellplan.pipeline.compare.compare import CompareJob, compare
    from cellplan.pipeline.export.choice import Choice
    from cellplan.pipeline.export.program import export_program
    from cellplan.pipeline.export.several import Exported, export_programs
    from cellplan.pipeline.fastest.result import write_fastest
    from cellplan.pipeline.fastest.shortest import ShortestCycles, fastest
    from cellplan.pipeline.floor_plan_file import FloorPlanRequest, requested_floor_plan, write_floor_plan
    from cellplan.pipeline.gate.open_gate import open_gate
    from cellplan.pipeline.layout.request import LayoutRequest
    from cellplan.pipeline.layout.search import LayoutResult, search_layout
    from cellplan.pipeline.present.frames import tables, to_frame
    from cellplan.pipeline.present.notebook import to_html
    from cellplan.pipeline.recover.recover import Recovery, recover
    from cellplan.pipeline.recover.result import write_recovery
    from cellplan.pipeline.rehearsal.rehearse import rehearse
    from cellplan.pipeline.rehearsal.result import write_rehearsal
    from cellplan.pipeline.repair.repair import Repair, repair
    from cellplan.pipeline.repair.result import write_repair
    from cellplan.pipeline.screen import screen
    from cellplan.pipeline.solution import Solution
    from cellplan.pipeline.solve import solve
    from cellplan.pipeline.sweep import SweepJob, sweep
    from cellplan.pipeline.verify import verify
    from cellplan.pipeline.view.write import ViewRequest, view, write_view
    from cellplan.pipeline.write_run import write_run
    from cellplan.planning.layout_screening import Candidates, Screening
    from cellplan.study.study import Stop
    from cellplan.study.variants import Axis

_HOME: Final = {
    "Axis": "study.variants",
    "BaseGrid": "pipeline.base_map.grid",
    "Candidates": "planning.layout_screening",
    "Cell": "model.cell",
    "CellplanError": "errors",
    "Check": "model.report",
    "Choice": "pipeline.export.choice",
    "CompareJob": "pipeline.compare.compare",
    "Exported": "pipeline.export.several",
    "FloorPlanRequest": "pipeline.floor_plan_file",
    "LayoutRequest": "pipeline.layout.request",
    "LayoutResult": "pipeline.layout.search",
    "MapRequest": "pipeline.base_map.prepared",
    "Motion": "model.motion",
    "Part": "model.cell",
    "Program": "model.motion",
    "Recovery": "pipeline.recover.recover",
    "Repair": "pipeline.repair.repair",
    "Report": "model.report",
    "Robot": "model.cell",
    "Screening": "planning.layout_screening",
    "ShortestCycles": "pipeline.fastest.shortest",
    "Solution": "pipeline.solution",
    "Stop": "study.study",
    "SweepJob": "pipeline.sweep",
    "Task": "model.task",
    "Toolpath": "model.toolpath",
    "VerifiedRun": "model.verified_run",
    "ViewRequest": "pipeline.view.write",
    "base_map": "pipeline.base_map.judged",
    "compare": "pipeline.compare.compare",
    "export_program": "pipeline.export.program",
    "export_programs": "pipeline.export.several",
    "fastest": "pipeline.fastest.shortest",
    "load_cell": "io.cell.load",
    "load_errors": "io.cell_errors",
    "map_study": "pipeline.base_map.study",
    "open_gate": "pipeline.gate.open_gate",
    "recover": "pipeline.recover.recover",
    "rehearse": "pipeline.rehearsal.rehearse",
    "repair": "pipeline.repair.repair",
    "requested_floor_plan": "pipeline.floor_plan_file",
    "screen": "pipeline.screen",
    "search_layout": "pipeline.layout.search",
    "solve": "pipeline.solve",
    "sweep": "pipeline.sweep",
    "tables": "pipeline.present.frames",
    "to_frame": "pipeline.present.frames",
    "to_html": "pipeline.present.notebook",
    "verify": "pipeline.verify",
    "view": "pipeline.view.write",
    "write_base_map": "pipeline.base_map.judged",
    "write_fastest": "pipeline.fastest.result",
    "write_floor_plan": "pipeline.floor_plan_file",
    "write_repair": "pipeline.repair.result",
    "write_recovery": "pipeline.recover.result",
    "write_rehearsal": "pipeline.rehearsal.result",
    "write_run": "pipeline.write_run",
    "write_view": "pipeline.view.write",
}

__all__ = [
    "Axis",
    "BaseGrid",
    "Candidates",
    "Cell",
    "CellplanError",
    "Check",
    "Choice",
    "CompareJob",
    "Exported",
    "FloorPlanRequest",
    "LayoutRequest",
    "LayoutResult",
    "MapRequest",
    "Motion",
    "Part",
    "Program",
    "Recovery",
    "Repair",
    "Report",
    "Robot",
    "Screening",
    "ShortestCycles",
    "Solution",
    "Stop",
    "SweepJob",
    "Task",
    "Toolpath",
    "VerifiedRun",
    "ViewRequest",
    "__version__",
    "base_map",
    "compare",
    "export_program",
    "export_programs",
    "fastest",
    "load_cell",
    "load_errors",
    "map_study",
    "open_gate",
    "recover",
    "rehearse",
    "repair",
    "requested_floor_plan",
    "screen",
    "search_layout",
    "solve",
    "sweep",
    "tables",
    "to_frame",
    "to_html",
    "verify",
    "view",
    "write_base_map",
    "write_fastest",
    "write_floor_plan",
    "write_recovery",
    "write_rehearsal",
    "write_repair",
    "write_run",
    "write_view",
]


def __getattr__(name: str) -> object:
    """Import a public name on first access."""
    if name not in _HOME:
        raise AttributeError(f"module 'cellplan' has no attribute '{name}'")
    return getattr(import_module(f"cellplan.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """The public names, before they are imported too."""
    return sorted({*globals(), *__all__})
