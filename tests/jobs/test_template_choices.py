"""Every line that a template offers in its comments gives a cell that passes."""

from pathlib import Path

import pytest
from builders.cell_comments import offered_choices, with_choice

from cellplan import load_cell, solve
from cellplan.files.templates import TEMPLATES, Template, template_files, write_folder

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda template: template.name)
def test_every_line_that_is_offered_passes(template: Template, tmp_path: Path) -> None:
    write_folder(tmp_path / "new", template_files(template))
    path = tmp_path / "new" / "cell.yaml"
    text = path.read_text(encoding="utf-8")
    for line in offered_choices(text):
        path.write_text(with_choice(text, line), encoding="utf-8")
        assert solve(load_cell(path)).passed, line
