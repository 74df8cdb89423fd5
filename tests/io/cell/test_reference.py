"""The reference pages are made from the formats of the files and from the docstrings of the public names."""

import importlib.util
from pathlib import Path

import cellplan


def test_the_reference_pages_are_up_to_date(repository: Path) -> None:
    spec = importlib.util.spec_from_file_location("make_reference", repository / "docs" / "make_reference.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)

    page = (repository / "docs" / "reference" / "cell-file.md").read_text(encoding="utf-8")

    assert page == script.reference(), "run: python docs/make_reference.py"
    errors_page = (repository / "docs" / "reference" / "errors-file.md").read_text(encoding="utf-8")
    assert errors_page == script.errors_reference(), "run: python docs/make_reference.py"
    api_page = (repository / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    assert api_page == script.api_reference(), "run: python docs/make_reference.py"
    assert [name for name in cellplan.__all__ if f"### `{name}`" not in api_page] == ["__version__"]
