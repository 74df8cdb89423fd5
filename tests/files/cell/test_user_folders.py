"""Folders that the user allows for every cell: by a variable or by a configuration of the user's own."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell.user_folders import user_folders
from cellplan.geometry.shapes import Mesh

Load = Callable[..., object]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's own configuration folder, and a mesh in a folder that no cell may read from by itself."""
    monkeypatch.delenv("CELLPLAN_ALLOW_DIRS", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    (tmp_path / "home" / "cellplan").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "cells").mkdir()
    trimesh.creation.box((500, 300, 200)).export(tmp_path / "elsewhere" / "a.stl")
    return tmp_path / "home"


def write_config(home: Path, text: str) -> Path:
    path = home / "cellplan" / "config.yaml"
    path.write_text(text, encoding="utf-8")
    path.chmod(0o600)
    return path


def allowed(home: Path) -> tuple[Path, ...]:
    return user_folders(home.parent / "cells")


def test_nothing_is_allowed_unless_the_user_says_so(home: Path) -> None:
    assert allowed(home) == ()


def test_the_variable_names_folders_by_absolute_paths(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = [str(home), "", ".", "meshes", str(home / "x")]
    monkeypatch.setenv("CELLPLAN_ALLOW_DIRS", os.pathsep.join(words))

    assert allowed(home) == (home, home / "x")


def test_the_configuration_names_folders(home: Path) -> None:
    write_config(home, f"allow_dirs: [{home}, ~/meshes]\n")

    assert allowed(home) == (home, Path.home() / "meshes")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("allow_dirs: [meshes]\n", "config.yaml:1: allow_dirs[0]: expected an absolute path of a folder, got 'meshes'"),
        ("allow_dirs: /\n", "config.yaml:1: allow_dirs: expected a list of folders, got '/'"),
        ("\nallow_dir: []\n", "config.yaml:2: allow_dir: unknown key; allowed: allow_dirs"),
    ],
)
def test_a_wrong_configuration_is_reported_with_its_line(home: Path, text: str, message: str) -> None:
    write_config(home, text)

    with pytest.raises(InvalidFileError) as caught:
        allowed(home)
    assert str(caught.value) == f"{home}/cellplan/{message}"


def test_a_configuration_that_others_may_write_is_not_believed(home: Path) -> None:
    path = write_config(home, f"allow_dirs: [{home}]\n")
    path.chmod(0o666)
    assert allowed(home) == ()

    path.unlink()
    os.mkfifo(path)
    assert allowed(home) == ()


@pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can give a file away")
def test_a_configuration_of_somebody_else_is_not_believed(home: Path) -> None:
    os.chown(write_config(home, f"allow_dirs: [{home}]\n"), 4711, -1)

    assert allowed(home) == ()


def test_a_configuration_that_may_have_come_with_the_cell_is_not_believed(home: Path) -> None:
    write_config(home, f"allow_dirs: [{home}]\n")

    assert user_folders(home.parent) == ()
    assert user_folders(home / "cellplan") == ()


def test_a_relative_place_for_the_configuration_is_passed_over(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_config(home, f"allow_dirs: [{home}]\n")
    monkeypatch.chdir(home.parent)
    monkeypatch.setenv("XDG_CONFIG_HOME", "home")
    monkeypatch.setenv("HOME", str(home.parent / "nobody"))

    assert allowed(home) == ()


def test_a_cell_reads_from_there_as_with_the_option(
    load: Load, home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = (home.parent / "elsewhere").rename(tmp_path.parent / f"{tmp_path.name}-elsewhere")
    cylinder = "{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}"
    change = (cylinder, f"{{mesh: {elsewhere}/a.stl, unit: mm}}")
    with pytest.raises(InputError, match="allow other folders with --allow-dir"):
        load(change)

    monkeypatch.setenv("CELLPLAN_ALLOW_DIRS", str(elsewhere))

    assert isinstance(load(change).part.shape, Mesh)
