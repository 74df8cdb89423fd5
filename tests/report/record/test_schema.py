"""The JSON Schema of ``report.json``: valid itself, and every kind of report conforms to it."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.records import phase_record, whole_record
from jsonschema import Draft202012Validator

from cellplan.cli.main import run as run_cli
from cellplan.model.motion.motion import Motion, NearestSingular, Resolution
from cellplan.model.solver import Integrator
from cellplan.report.record.common import as_json
from cellplan.report.record.schema import report_schema, series_schema
from cellplan.report.record.series import series_json

pytestmark = pytest.mark.usefixtures("stored_solutions")

ENDS = 25  # entries of a long list that are validated, from each end


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    """Refuses unknown keys as well: none may be written that the types do not name."""
    schema = report_schema(closed=True)
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def findings(validator: Draft202012Validator, record: Any) -> list[str]:
    """Why a record does not conform, by its own branch of the schema."""
    schema = validator.schema
    branch = Draft202012Validator({**schema["oneOf"]["runs" in record], "$defs": schema["$defs"]})
    return [f"{error.json_path}: {error.message}" for error in branch.iter_errors(record)]


def planned(run: Any) -> Motion:
    """A motion with everything that its steps can have."""
    steps = len(run.report.times) - 1
    lost = NearestSingular(robot="kuka", task="circle", smallest=1e-4, stack=1e-5)
    resolution = Resolution(
        integrator=Integrator.ACCURATE, panels=2, nodes=18, sweeps=4, solves=72, error_between=1e-9, lost=lost
    )
    q = np.zeros((steps + 1, 1))
    return Motion(times=run.report.times, q=q, iterations=np.ones(steps), slack=np.zeros(steps), resolution=resolution)


def shortened(value: Any) -> Any:
    """A record whose long lists hold their first and last entries only: all of a list are of one type."""
    if isinstance(value, dict):
        return {key: shortened(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [shortened(entry) for entry in (value if len(value) <= 2 * ENDS else value[:ENDS] + value[-ENDS:])]
    return value


@pytest.mark.parametrize("kind", ["passed_run", pytest.param("failed_run", marks=pytest.mark.slow), "rail_run"])
@pytest.mark.parametrize("has_motion", [False, True])
def test_the_report_of_a_run_conforms(
    validator: Draft202012Validator, kind: str, has_motion: bool, request: pytest.FixtureRequest
) -> None:
    run = request.getfixturevalue(kind)
    motion = planned(run) if has_motion else None
    record = phase_record(run.report, cell=run.cell, provenance=run.provenance, motion=motion)

    assert findings(validator, json.loads(as_json(record))) == []


def test_the_report_of_several_runs_conforms(validator: Draft202012Validator, pairwise_runs: Any) -> None:
    first = pairwise_runs["circle"]
    reports = {name: run.report for name, run in pairwise_runs.items()}
    record = whole_record(reports, cell=first.cell, provenance=first.provenance)

    assert findings(validator, json.loads(as_json(record))) == []


@pytest.mark.parametrize("options", [[], ["--method", "quadratic_program"], ["--task", "path"]])
def test_the_reports_of_solved_cells_conform(
    validator: Draft202012Validator, sound: Path, tmp_path: Path, options: list[str]
) -> None:
    run_cli(["solve", str(sound / "cell" / "small.yaml"), "-o", str(tmp_path / "run"), "-q", *options])

    assert findings(validator, json.loads((tmp_path / "run" / "report.json").read_text(encoding="utf-8"))) == []


def test_the_reports_of_a_pairwise_cell_conform(validator: Draft202012Validator, sound: Path, tmp_path: Path) -> None:
    run_cli(["solve", str(sound / "cell" / "small.yaml"), "-o", str(tmp_path / "run"), "-q", "--mode", "pairwise"])

    files = sorted((tmp_path / "run").rglob("report.json"))
    assert len(files) >= 2
    for file in files:
        assert findings(validator, json.loads(file.read_text(encoding="utf-8"))) == []


def test_a_damaged_report_does_not_conform(validator: Draft202012Validator, passed_run: Any) -> None:
    record = json.loads(
        as_json(phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance))
    )
    for damage in (
        lambda it: it.pop("caution"),
        lambda it: it.update(surprise=1),
        lambda it: it["tasks"]["circle"].update(cycles="one"),
        lambda it: it["joints"]["kuka"]["B1"].pop("margin"),
        lambda it: it["checks"][0].update(passed="yes"),
    ):
        damaged = copy.deepcopy(record)
        damage(damaged)
        assert len(findings(validator, damaged)) == 1


def test_the_published_schema_permits_keys_that_later_releases_add(passed_run: Any) -> None:
    schema = report_schema()
    Draft202012Validator.check_schema(schema)
    record = phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance)
    later = {**record, "runs_later": 1}

    assert Draft202012Validator({**schema, "oneOf": schema["oneOf"][:1]}).is_valid(json.loads(json.dumps(later)))


@pytest.mark.parametrize("kind", ["passed_run", "failed_run", "rail_run"])
@pytest.mark.parametrize("has_motion", [False, True])
def test_the_series_of_a_run_conform(kind: str, has_motion: bool, request: pytest.FixtureRequest) -> None:
    run = request.getfixturevalue(kind)
    schema = series_schema(closed=True)
    Draft202012Validator.check_schema(schema)
    curves = shortened(json.loads(series_json(run.report, planned(run) if has_motion else None)))

    assert list(map(str, Draft202012Validator(schema).iter_errors(curves))) == []
    del curves["joints"]
    assert not Draft202012Validator(schema).is_valid(curves)


def test_the_files_of_the_docs_are_the_schemas(repository: Path, sound: Path) -> None:
    folder = repository / "docs" / "reference"
    for name, schema in (("report", report_schema()), ("series", series_schema())):
        text = (folder / f"{name}.schema.json").read_text(encoding="utf-8")
        assert json.loads(text) == schema, "run: python docs/make_reference.py"
        record = json.loads((sound / "run" / f"{name}.json").read_text(encoding="utf-8"))
        assert Draft202012Validator(json.loads(text)).is_valid(record)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["four_robots", "four_robots_initial", "load_sharing", "rail", "three_tasks_each", "turntable"]
)
def test_the_reports_and_series_of_shipped_cells_conform(
    validator: Draft202012Validator, cells: Path, tmp_path: Path, name: str
) -> None:
    run_cli(["solve", str(cells / f"{name}.yaml"), "-o", str(tmp_path / "run"), "-q"])

    curves = Draft202012Validator(series_schema(closed=True))
    assert (tmp_path / "run" / "report.json").is_file()
    for file in sorted((tmp_path / "run").rglob("report.json")):
        assert findings(validator, json.loads(file.read_text(encoding="utf-8"))) == []
    for file in sorted((tmp_path / "run").rglob("series.json")):
        assert curves.is_valid(json.loads(file.read_text(encoding="utf-8")))


def test_every_key_has_a_description() -> None:
    silent = [
        f"{name}.{key}"
        for name, entry in (report_schema()["$defs"] | series_schema()["$defs"]).items()
        for key, field in entry["properties"].items()
        if not field.get("description")
    ]
    assert silent == []


def test_the_command_prints_the_schema(capsys: pytest.CaptureFixture[str]) -> None:
    status = run_cli(["schema", "--report"])

    assert status == 0
    assert json.loads(capsys.readouterr().out) == report_schema()
