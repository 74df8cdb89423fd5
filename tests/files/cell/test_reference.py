"""The reference of the files is made from their formats and says what the formats say."""

import importlib.util
from pathlib import Path


def test_the_reference_page_is_up_to_date(repository: Path) -> None:
    spec = importlib.util.spec_from_file_location("make_reference", repository / "docs" / "make_reference.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)

    page = (repository / "docs" / "reference" / "cell-file.md").read_text(encoding="utf-8")

    assert page == script.reference(), "run: python docs/make_reference.py"
    errors_page = (repository / "docs" / "reference" / "errors-file.md").read_text(encoding="utf-8")
    assert errors_page == script.errors_reference(), "run: python docs/make_reference.py"
    layout_page = (repository / "docs" / "reference" / "layout-json.md").read_text(encoding="utf-8")
    assert layout_page == script.layout_reference(), "run: python docs/make_reference.py"
