"""References that are made from the program: the Python API from its docstrings, the commands from their options."""

import importlib.util
from pathlib import Path
from types import ModuleType

import cellplan


def script(path: Path) -> ModuleType:
    """A script of the documentation as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_api_page_is_up_to_date_and_has_every_public_name(repository: Path) -> None:
    page = (repository / "docs" / "reference" / "api.md").read_text(encoding="utf-8")

    made = script(repository / "docs" / "make_api_reference.py").api_reference()

    assert page == made, "run: python docs/make_api_reference.py"
    assert [name for name in cellplan.__all__ if f"### `{name}`" not in page] == ["__version__"]


def test_the_page_of_commands_is_up_to_date(repository: Path) -> None:
    page = (repository / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")

    made = script(repository / "docs" / "make_command_reference.py").command_reference()

    assert page == made, "run: python docs/make_command_reference.py"
