"""Files round the package: constraints, the workflow of the public CI, decision records."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from builders import kernels

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = PROJECT["optional-dependencies"]
LINES = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()


def plain(name: str) -> str:
    """A package name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version))


@pytest.mark.parametrize("requirement", [*PROJECT["dependencies"], *OPTIONAL["dev"], *OPTIONAL["docs"]])
def test_the_constraints_hold_every_dependency_in_an_allowed_version(requirement: str) -> None:
    pinned = {plain(line.partition("==")[0]): line.partition("==")[2] for line in LINES}
    name, _, least = requirement.partition(">=")

    assert numbers(pinned[plain(name)]) >= numbers(least)


def test_the_constraints_are_versions_and_nothing_else() -> None:
    assert [line for line in LINES if not re.fullmatch(r"# .*|[A-Za-z0-9_.-]+==[0-9][A-Za-z0-9.+!]*", line)] == []
    assert [line for line in LINES if "://" in line or line.startswith("cellplan")] == []


def test_the_workflow_runs_what_exists_and_needs_no_secret() -> None:
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    commands = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    targets = {match for command in commands for match in re.findall(r"\bmake ([\w-]+)", command)}
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")

    assert targets == {"test", "test-kernels", "install", "docs"}
    assert [target for target in targets if not re.search(rf"^{target}:", makefile, re.MULTILINE)] == []
    assert [
        path for command in commands for path in re.findall(r"tests/\S+", command) if not (ROOT / path).exists()
    ] == []
    assert "secrets" not in text
    assert jobs["linux"]["strategy"]["matrix"]["python"] == ["3.11", "3.12", "3.13", "3.14"]
    assert jobs["kernels"]["strategy"]["matrix"]["kernel"] == [*kernels.KERNELS, kernels.BASELINE]


def test_every_decision_is_listed_under_its_number() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    records = sorted(folder.glob("0*.md"))

    assert [record.name for record in records if f"]({record.name})" not in index] == []
    titles = [record.read_text(encoding="utf-8").partition("\n")[0] for record in records]
    assert [
        title for title, record in zip(titles, records, strict=True) if f"# {int(record.name[:4])}. " not in title
    ] == []


def test_what_shows_a_guarantee_exists() -> None:
    page = (ROOT / "docs" / "reference" / "guarantees.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:tests|benchmarks)/[\w./]+)`", page))

    assert len(named) > 100
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_a_test_that_hangs_is_ended(request: pytest.FixtureRequest) -> None:
    """By a plug-in that `make install` brings; an environment that is older than it lets tests hang."""
    assert any(requirement.startswith("pytest-timeout") for requirement in OPTIONAL["dev"])
    if request.config.pluginmanager.hasplugin("timeout"):
        assert request.node.get_closest_marker("timeout").args[0] <= 300
