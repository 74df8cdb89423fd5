"""The reference of the Python API is made from the docstrings of the public names."""

import importlib.util
from pathlib import Path

import cellplan


def test_the_api_page_is_up_to_date_and_has_every_public_name(repository: Path) -> None:
    spec = importlib.util.spec_from_file_location("make_api_reference", repository / "docs" / "make_api_reference.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)

    page = (repository / "docs" / "reference" / "api.md").read_text(encoding="utf-8")

    assert page == script.api_reference(), "run: python docs/make_api_reference.py"
    assert [name for name in cellplan.__all__ if f"### `{name}`" not in page] == ["__version__"]
