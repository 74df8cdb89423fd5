"""A new folder with a cell to begin with."""

import json
import re
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.files.templates import TEMPLATES


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.mark.slow
@pytest.mark.usefixtures("stored_solutions")
def test_the_first_template_passes_by_the_commands_that_are_printed(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["init", "demo"]) == 0

    lines = capsys.readouterr().out.splitlines()
    steps = [line.strip() for line in lines[lines.index("next:") + 1 :]]
    assert steps[0] == "cd demo"
    monkeypatch.chdir("demo")
    assert names(Path()) == ["README.md", "cell.schema.json", "cell.yaml"]
    for step in steps[1:-1]:
        assert run([*step.split()[1:], "--quiet"]) == 0
    page = steps[-1].split()[1]
    assert Path(page).read_text(encoding="utf-8").lower().startswith("<!doctype html>")


@pytest.mark.slow
@pytest.mark.parametrize("name", [template.name for template in TEMPLATES])
def test_every_command_on_the_page_of_a_template_passes(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    run(["init", "new", "-t", name])
    monkeypatch.chdir("new")
    blocks = re.findall(r"^```sh\n(.*?)^```$", Path("README.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    commands = [line.split() for block in blocks for line in block.splitlines()]

    assert {words[1] for words in commands} >= {"check", "solve"}
    for words in commands:
        assert run([*words[1:]]) == 0, words


def test_a_template_is_chosen_by_its_name(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "my cell", "--template", "turntable"]) == 0

    assert names(place / "my cell") == [
        "README.md",
        "cell.schema.json",
        "cell.yaml",
        "robot.schema.json",
        "robots/turntable.yaml",
    ]
    assert "\n  cd 'my cell'\n" in capsys.readouterr().out


def test_the_working_folder_may_be_filled_when_it_is_empty(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "."]) == 0
    assert "  cd " not in capsys.readouterr().out

    before = {name: (place / name).read_bytes() for name in names(place)}
    assert run(["init", ".", "--template", "rail"]) == 2
    assert capsys.readouterr().err == (
        "error: .: holds 'README.md', and nothing is overwritten; name a new or an empty folder\n"
    )
    assert {name: (place / name).read_bytes() for name in names(place)} == before


def test_the_list_has_one_line_for_each_template(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "--list"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [template.name for template in TEMPLATES]
    assert {line.index(template.summary) for line, template in zip(lines, TEMPLATES, strict=True)} == {14}


def test_scripts_get_one_object(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "demo", "--json"]) == 0
    written = json.loads(capsys.readouterr().out)
    assert (written["status"], written["template"]) == ("written", "two-robots")
    assert written["files"] == names(place / "demo")

    assert run(["init", "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed["templates"]] == [template.name for template in TEMPLATES]

    assert run(["init", "demo", "--json"]) == 2
    refused = json.loads(capsys.readouterr().out)
    assert refused["status"] == "error"
    assert "nothing is overwritten" in refused["errors"][0]


@pytest.mark.parametrize("arguments", [[], ["demo", "--list"], ["--list", "--template", "rail"]])
def test_a_folder_or_the_list_is_asked_for(
    place: Path, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    assert run(["init", *arguments]) == 2

    assert "expected either a folder, or --list alone" in capsys.readouterr().err
    assert names(place) == []


def test_an_unknown_template_writes_nothing(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "demo", "--template", "turn-table"]) == 2

    assert "did you mean 'turntable'?" in capsys.readouterr().err
    assert not (place / "demo").exists()
