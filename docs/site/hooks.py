"""What MkDocs needs to know of these pages: navigation, links to files of the repository, and formulas."""

import html
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pymdownx.slugs import slugify

DOCS = Path(__file__).resolve().parent.parent
ROOT = DOCS.parent
SECTION = re.compile(r"^## (?P<title>.+)\n(?P<text>(?:(?!## ).*\n?)*)", re.MULTILINE)
GROUP = re.compile(r"^### (.+)\n", re.MULTILINE)
ROW = re.compile(r"^- \[(?P<title>[^\]]+)\]\((?P<target>[^)#]+)\)", re.MULTILINE)
LINK = re.compile(r"\]\((?P<target>[^)#\s:]+)(?P<anchor>#[^)]*)?\)")
FORMULA = re.compile(r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL)
MESSAGE = re.compile(r'<!-- (?:from|source): [^>]*-->\s*<div class="')  # of the page of messages
LONG_NAME = re.compile(r"(?<=<code>)[^<]{25,}(?=</code>)")
SEAM = re.compile(r"(?<=[/_.=])(?=\w)")  # where a long name may be broken
AS_TYPED = [  # signs of which browsers would stretch one of two: bars, and parentheses of which one has an exponent
    ("<mo>&#x0007C;</mo>", '<mo stretchy="false">&#x0007C;</mo>'),
    ('stretchy="true" fence="true" minsize="1.2em" maxsize="1.2em"', 'stretchy="false"'),
]
LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Take the navigation from the lists of the start page, and anchors as code hosts make them."""
    config.nav = [{"Start": "index.md"}, *navigation(DOCS / "index.md")]
    config.mdx_configs["toc"]["slugify"] = slugify(case="lower")
    return config


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add every file of the repository outside the documentation that a page, or such a file, links to."""
    todo = [Path(file.abs_src_path) for file in files.documentation_pages() if file.abs_src_path is not None]
    added: set[Path] = set()
    for page in todo:
        for path in sorted(outside(page) - added):
            added.add(path)
            files.append(file_of(path, config))
            if path.suffix == ".md":
                todo.append(path)
    return files


def on_page_markdown(markdown: str, *, page: Page, **_: object) -> str:
    """Lead links that leave the documentation, or come back to it, to where the site has their targets."""
    if page.file.abs_src_path is None:
        return markdown
    source = Path(page.file.abs_src_path)
    up = "../" * page.file.src_uri.count("/")

    def led(match: re.Match[str]) -> str:
        path = (source.parent / match["target"]).resolve()
        if is_outside(path):
            return f"]({up}{place_of(path)}{match['anchor'] or ''})"
        comes_back = is_outside(source) and path.is_relative_to(DOCS)
        return f"]({up}{path.relative_to(DOCS)}{match['anchor'] or ''})" if comes_back else match[0]

    return LINK.sub(led, markdown)


def on_page_content(html_text: str, *, page: Page, **_: object) -> str:
    """Write formulas as MathML, which browsers draw without a script; let messages and long names be broken."""

    def figure(match: re.Match[str]) -> str:
        display = "block" if match["tag"] == "div" else "inline"
        try:
            formula = convert(html.unescape(match["tex"]).strip(), display=display)
        except Exception as error:
            raise PluginError(f"{page.file.src_uri}: cannot read the formula {match['tex']}: {error}") from error
        for grown, plain in AS_TYPED:
            formula = formula.replace(grown, plain)
        return f'<span class="formula">{formula}</span>' if display == "block" else formula

    broken = LONG_NAME.sub(lambda match: SEAM.sub("<wbr>", match[0]), MESSAGE.sub('<div class="message ', html_text))
    return FORMULA.sub(figure, broken)


def navigation(index: Path) -> list[dict[str, Any]]:
    """The lists of a page as navigation: sections, their groups, and pages in their order."""
    entries = []
    for section in SECTION.finditer(index.read_text(encoding="utf-8")):
        first, *groups = GROUP.split(section["text"])
        rows = listed(first)
        for title, text in zip(groups[::2], groups[1::2], strict=True):
            rows.append({title: listed(text)})
        entries.append({section["title"]: next(iter(rows[0].values())) if len(rows) == 1 else rows})
    return entries


def listed(text: str) -> list[dict[str, Any]]:
    """The list entries of a text that are links, as navigation."""
    return [entry(row["title"], row["target"]) for row in ROW.finditer(text)]


def entry(title: str, target: str) -> dict[str, Any]:
    """One page, or a folder whose README lists its pages."""
    title = title.replace("`", "")
    path = (DOCS / target).resolve()
    if path.name == "README.md" and not is_outside(path):
        below = ROW.findall(path.read_text(encoding="utf-8"))
        folder = target.removesuffix("README.md")
        return {title: [target, *({name: f"{folder}{page}"} for name, page in below)]}
    return {title: place_of(path) if is_outside(path) else target}


def outside(page: Path) -> set[Path]:
    """Files of the repository outside the documentation that a page links to."""
    targets = (page.parent / match["target"] for match in LINK.finditer(page.read_text(encoding="utf-8")))
    return {path for path in (target.resolve() for target in targets) if is_outside(path)}


def is_outside(path: Path) -> bool:
    """Whether a file belongs to the repository but not to its documentation."""
    return path.is_file() and path.is_relative_to(ROOT) and not path.is_relative_to(DOCS)


def place_of(path: Path) -> str:
    """Where the site has a file outside the documentation."""
    return f"files/{path.relative_to(ROOT).as_posix()}{'.md' if path.suffix in LANGUAGES else ''}"


def file_of(path: Path, config: MkDocsConfig) -> File:
    """A file outside the documentation for the site: a page that shows it, or the file itself."""
    if path.suffix not in LANGUAGES:
        return File.generated(config, place_of(path), abs_src_path=str(path))
    name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
    return File.generated(config, place_of(path), content=f"# {name}\n\n````{LANGUAGES[path.suffix]}\n{text}````\n")
