"""Records of reports that a test made, of one phase or of several."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Motion
from cellplan.model.report.report import Report
from cellplan.report.record.common import Provenance
from cellplan.report.record.run import run_record
from cellplan.report.record.sections.solver import PlanningFacts
from cellplan.report.record.summary import program_records


class OnePhase(NamedTuple):
    """A phase with its report."""

    report: Report
    cell: Cell


def phase_record(report: Report, *, cell: Cell, provenance: Provenance, motion: Motion | None = None) -> Any:
    """The record of one phase."""
    return run_record(OnePhase(report, cell), provenance=provenance, planning=PlanningFacts(motion=motion))


def whole_record(reports: Mapping[str, Report], *, cell: Cell, provenance: Provenance) -> Any:
    """The record of a program of several phases, by their names."""
    phases = [OnePhase(replace(report, phase=name), cell) for name, report in reports.items()]
    return program_records(phases, cell=cell, provenance=provenance).whole
