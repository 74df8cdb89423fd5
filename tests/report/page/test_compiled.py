"""Compiled templates are kept beside the templates, and never used when they do not belong to them."""

import sys
from pathlib import Path

import pytest
from jinja2 import DictLoader, Environment, StrictUndefined

from cellplan.report.page.compiled import CompiledTemplates


@pytest.fixture(autouse=True)
def written_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python keeps what it compiles in a folder of the test."""
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)


def shown(text: str, trim: bool = False) -> str:
    """What a process that has compiled nothing yet makes of a template named page.html."""
    environment = Environment(
        loader=DictLoader({"page.html": text}), autoescape=True, undefined=StrictUndefined, trim_blocks=trim
    )
    environment.bytecode_cache = CompiledTemplates(environment)
    return environment.get_template("page.html").render(name="<b>")


def entries(folder: Path) -> list[Path]:
    """What is kept."""
    return sorted(folder.rglob("*.template"))


def test_a_template_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = shown("Hello {{ name }}")
    monkeypatch.setattr(Environment, "compile", lambda *_: pytest.fail("compiled again"))

    assert first == shown("Hello {{ name }}") == "Hello &lt;b&gt;"
    assert len(entries(tmp_path)) == 1


def test_a_changed_template_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    assert [shown("one"), shown("two"), shown("two")] == ["one", "two", "two"]
    assert len(entries(tmp_path)) == 1


def test_other_options_are_other_templates() -> None:
    text = "{% if name %}\nyes{% endif %}"

    assert [shown(text, trim=trim) for trim in (False, True, False)] == ["\nyes", "yes", "\nyes"]


@pytest.mark.parametrize("length", [0, 10, 40, 200])
def test_a_damaged_file_is_made_again(length: int, tmp_path: Path) -> None:
    shown("Hello {{ name }}")
    (file,) = entries(tmp_path)
    whole = file.read_bytes()
    file.write_bytes(whole[:length])

    assert shown("Hello {{ name }}") == "Hello &lt;b&gt;"
    assert file.read_bytes() == whole


def test_nothing_is_written_where_python_may_not_or_cannot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert shown("text") == "text"
    assert not entries(tmp_path)

    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path / "file"))
    assert shown("text") == "text"
