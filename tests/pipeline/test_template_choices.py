"""Every line that a template offers in its comments, and the change on its page, give a cell that passes."""

from pathlib import Path

import pytest
import yaml
from builders.cell_comments import offered_choices, with_choice

from cellplan import load_cell, solve
from cellplan.io.templates import TEMPLATES, Template, template_files, write_folder

pytestmark = pytest.mark.slow


@pytest.fixture(params=[pytest.param(template, id=template.name) for template in TEMPLATES])
def template(request: pytest.FixtureRequest) -> Template:
    chosen: Template = request.param
    return chosen


@pytest.fixture
def path(template: Template, tmp_path: Path) -> Path:
    """The cell of a template."""
    write_folder(tmp_path / "new", template_files(template))
    return tmp_path / "new" / "cell.yaml"


def test_the_proposed_change_passes(template: Template, path: Path) -> None:
    key, _, value = template.setting.partition("=")

    assert solve(load_cell(path).with_values({key: yaml.safe_load(value)})).passed


def test_every_line_that_is_offered_passes(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for line in offered_choices(text):
        path.write_text(with_choice(text, line), encoding="utf-8")
        assert solve(load_cell(path)).passed, line
