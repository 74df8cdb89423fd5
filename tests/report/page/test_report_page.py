"""The reference page of ``report.json`` names every key that a report has."""

import importlib.util
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.records import phase_record, whole_record

from cellplan.model.motion.motion import Motion, Resolution
from cellplan.model.solver import Integrator
from cellplan.report.record.common import as_json

DECLARED_NAMES = {"inputs", "digests", "versions"}  # the keys below these are names of files and packages


def keys(tree: Any, names: set[str]) -> set[str]:
    """All keys of a record but the names that a user gave."""
    if isinstance(tree, list):
        return {key for entry in tree for key in keys(entry, names)}
    if not isinstance(tree, dict):
        return set()
    result = set(tree) - names
    return result | {key for name, entry in tree.items() if name not in DECLARED_NAMES for key in keys(entry, names)}


@pytest.fixture
def reports(rail_run: Any, pairwise_runs: Any) -> list[Any]:
    steps = len(rail_run.report.times) - 1
    q = np.zeros((steps + 1, 1))
    made = Resolution(integrator=Integrator.ACCURATE, panels=2, nodes=18, sweeps=4, solves=72, error_between=1e-9)
    motion = Motion(times=rail_run.report.times, q=q, iterations=np.ones(steps), slack=np.zeros(steps), resolution=made)
    one = as_json(phase_record(rail_run.report, cell=rail_run.cell, provenance=rail_run.provenance, motion=motion))
    runs = {name: run.report for name, run in pairwise_runs.items()}
    several = as_json(whole_record(runs, cell=rail_run.cell, provenance=rail_run.provenance))
    return [json.loads(one), json.loads(several)]


def test_every_key_stands_on_the_page(repository: Path, reports: list[Any]) -> None:
    page = (repository / "docs" / "reference" / "report-json.md").read_text(encoding="utf-8")
    named = {word for code in re.findall(r"`([^`\n]+)`", page) for word in re.split(r"[.\s]+", code)}
    cell_names = {name for robot, uses in reports[0]["joints"].items() for name in (robot, *uses)}
    cell_names |= set(reports[0]["tasks"])
    for report in reports:
        for phase, quantities in report["figures"].items():
            cell_names |= {phase, *(subject for subjects in quantities.values() for subject in subjects)}

    unnamed = {key for report in reports for key in keys(report, cell_names)} - named

    assert sorted(unnamed) == []


def test_the_page_is_the_one_made_from_the_types(repository: Path) -> None:
    spec = importlib.util.spec_from_file_location("make_reference", repository / "docs" / "make_reference.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)

    page = (repository / "docs" / "reference" / "report-json.md").read_text(encoding="utf-8")

    assert page == script.report_reference(), "run: python docs/make_reference.py"
