"""The templates: complete, described by their schema, and with comments that hold."""

import json
import re
import shutil
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from builders.cell_comments import offered_choices, quoted_words, with_choice
from jsonschema import Draft202012Validator, ValidationError

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.files.templates import TEMPLATES, Template, template_files, template_named, write_folder

LONG = {"step-frame"}  # eight seams of a drawing, which `tests/files/cell/test_edge_paths.py` reads too
NAMED = [
    pytest.param(template, id=template.name, marks=pytest.mark.slow if template.name in LONG else ())
    for template in TEMPLATES
]


@pytest.fixture(scope="module", params=NAMED)
def template(request: pytest.FixtureRequest) -> Template:
    chosen: Template = request.param
    return chosen


@pytest.fixture(scope="module")
def folder(template: Template, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The template, away from the other cells; not to be changed."""
    folder = tmp_path_factory.mktemp(template.name) / "new"
    write_folder(folder, template_files(template))
    return folder


def test_a_template_needs_nothing_beside_its_folder(template: Template, folder: Path) -> None:
    cell = load_cell(folder / "cell.yaml")

    assert cell.name == template.name


def test_the_change_that_the_page_proposes_changes_the_cell(template: Template, folder: Path) -> None:
    cell = load_cell(folder / "cell.yaml")
    key, _, value = template.setting.partition("=")

    assert render_cell(cell.with_values({key: yaml.safe_load(value)})) != render_cell(cell)


@cache
def validator(schema: str) -> Draft202012Validator:
    """Validator of a schema, which is itself sound."""
    rules = json.loads(schema)
    Draft202012Validator.check_schema(rules)
    return Draft202012Validator(rules)


def test_every_file_conforms_to_the_schema_that_its_first_line_names(folder: Path) -> None:
    files = sorted(folder.rglob("*.yaml"))
    for file in files:
        first, _, rest = file.read_text(encoding="utf-8").partition("\n")
        named = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first)
        assert named is not None
        rules = validator((file.parent / named[1]).read_text(encoding="utf-8"))
        content = yaml.safe_load(rest)
        rules.validate(content)
        with pytest.raises(ValidationError, match="'colour' was unexpected"):
            rules.validate(content | {"colour": "red"})
    assert folder / "cell.yaml" in files


def test_every_line_that_is_offered_in_a_comment_is_read(folder: Path, tmp_path: Path) -> None:
    path = shutil.copytree(folder, tmp_path / "copy") / "cell.yaml"
    text = path.read_text(encoding="utf-8")
    original = render_cell(load_cell(path))
    for line in offered_choices(text):
        path.write_text(with_choice(text, line), encoding="utf-8")
        assert render_cell(load_cell(path)) != original, line


def test_comments_name_keys_that_exist(folder: Path) -> None:
    schema = json.loads((folder / "cell.schema.json").read_text(encoding="utf-8"))
    known = keys_of(schema)
    for file in folder.rglob("*.yaml"):
        assert quoted_words(file.read_text(encoding="utf-8")) <= known


def keys_of(node: Any) -> set[str]:
    """Every key that a schema names, and every word that it allows as a value."""
    if isinstance(node, list):
        return {key for item in node for key in keys_of(item)}
    if not isinstance(node, dict):
        return set()
    names = set(node.get("properties", {})) | {word for word in node.get("enum", []) if isinstance(word, str)}
    return names | {key for item in node.values() for key in keys_of(item)}


def test_the_page_names_the_cell_and_its_schema(template: Template, folder: Path) -> None:
    page = (folder / "README.md").read_text(encoding="utf-8")

    assert f"outputs/{template.name}/" in page
    assert f"cellplan solve cell.yaml --set {template.setting}" in page


def test_every_file_of_a_template_goes_into_the_wheel(repository: Path, template: Template) -> None:
    wheel = tomllib.loads((repository / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    included = {Path(place): Path(source) for source, place in wheel["force-include"].items()}

    for name in (template.source, *template.files):
        target = Path("cellplan/templates", name)
        sources = [
            source / target.relative_to(place) for place, source in included.items() if target.is_relative_to(place)
        ]
        assert sources == [Path("cells", name)]


def test_every_template_has_its_row_with_a_picture_in_the_guide(repository: Path, template: Template) -> None:
    guide = (repository / "docs" / "guides" / "templates.md").read_text(encoding="utf-8")
    (row,) = [line for line in guide.splitlines() if line.startswith(f"| `{template.name}`: ")]

    assert f"`cells/{template.source}`" in row
    assert all(f"`cells/{name}`" in row for name in template.files if name.startswith("robots/"))
    assert f"](../images/templates/{template.name}.png) |" in row
    picture = repository / "docs" / "images" / "templates" / f"{template.name}.png"
    assert 5_000 < picture.stat().st_size < 60_000


def test_an_unknown_template_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(InputError, match=r"expected one of two-robots, .*, got 'turntble', did you mean 'turntable'\?"):
        template_named("turntble")


def test_the_first_template_has_two_robots() -> None:
    """It is the one that is written when no name is given."""
    assert TEMPLATES[0].name == "two-robots"
    assert len({template.name for template in TEMPLATES}) == len(TEMPLATES)
