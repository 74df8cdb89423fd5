"""The documentation as a site: every page is in the navigation, every anchor exists, and the site needs no network."""

import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

import pytest
from builders.browser import Browser

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
SECTIONS = [
    "Tutorial",
    "Guides",
    "Examples",
    "Concepts",
    "Reference",
    "Troubleshooting",
    "Comparison",
    "Developing",
]
LINK = re.compile(r"\]\((?P<target>[^)#\s:]*)(?:#(?P<anchor>[^)\s]+))?\)")
ROW = re.compile(r"^- \[[^\]]+\]\(([^)#]+)\)", re.MULTILINE)
FENCE = re.compile(r"^(`{3,})\w*\n.*?^\1$", re.MULTILINE | re.DOTALL)
LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=[\"']?([^\"' >]+)|url\(([^)]+)\)|@import")
NEXT_FRAME = "await new Promise((go) => setTimeout(go, 300));"


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as code hosts make them."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#{1,6} (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_page_stands_once_in_the_navigation() -> None:
    listed = Counter(
        (index.parent / target).resolve()
        for index in (DOCS / "index.md", DOCS / "decisions" / "README.md")
        for target in ROW.findall(index.read_text(encoding="utf-8"))
    )

    assert [page for page in PAGES if listed[page] != (page.name != "index.md")] == []


def test_the_sections_of_the_start_page_have_their_order() -> None:
    text = (DOCS / "index.md").read_text(encoding="utf-8")

    assert re.findall(r"^## (.+)$", text, re.MULTILINE) == SECTIONS


def test_the_pictures_of_the_tutorial_are_few_and_small() -> None:
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    sizes = {path.name: path.stat().st_size for path in (DOCS / "images" / "tutorial").iterdir()}

    assert set(re.findall(r"\]\(images/tutorial/([^)]+)\)", text)) == set(sizes)
    assert len(sizes) <= 6
    assert max(sizes.values()) <= 80_000


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_every_anchor_that_a_page_names_exists(page: Path) -> None:
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    named = [
        (page.parent / match["target"] if match["target"] else page, match["anchor"])
        for match in LINK.finditer(text)
        if match["anchor"] and match["target"].endswith((".md", ""))
    ]

    assert [f"{target.name}#{anchor}" for target, anchor in named if anchor not in anchors(target)] == []


def build(root: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Build the site of a checkout, with warnings as errors."""
    command = [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site of this checkout."""
    folder = tmp_path_factory.mktemp("site")
    run = build(ROOT, folder)
    assert "No module named" not in run.stderr, "install with: pip install --editable '.[docs]'"
    assert run.returncode == 0, run.stdout + run.stderr
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as opened:
        yield opened


def show(browser: Browser, page: Path, size: tuple[int, int], theme: str) -> None:
    """Open a page of the site in a window of a size."""
    browser.console.clear()
    browser.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
    browser.command(
        "Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False
    )
    browser.command("Page.navigate", url=f"file://{page}")
    browser.run(
        "while (document.readyState !== 'complete') await new Promise((go) => setTimeout(go, 20));" + NEXT_FRAME
    )


@pytest.mark.slow
def test_every_link_of_the_site_leads_to_a_file(site: Path) -> None:
    named = [
        (path, unquote(target.partition("#")[0]))
        for path in sorted(site.rglob("*.html"))
        if path.name != "404.html"  # its links begin at the root of a server
        for target in re.findall(r'<a\b[^>]*?href="([^"]*)"', path.read_text(encoding="utf-8"))
        if not re.match(r"[a-z]+:", target)
    ]

    assert len(named) > 1000
    assert [(path.name, target) for path, target in named if not (path.parent / target).exists()] == []


@pytest.mark.slow
def test_the_site_loads_nothing_from_the_network_and_shows_all_formulas(site: Path) -> None:
    pages = {path: path.read_text(encoding="utf-8") for path in sorted(site.rglob("*.html"))}
    styles = {path: path.read_text(encoding="utf-8") for path in sorted(site.rglob("*.css"))}
    loaded = [
        (path.name, target)
        for path, text in (pages | styles).items()
        for address in LOADED.findall(text)
        if (target := "".join(address)).strip("'\"").startswith(("http:", "https:", "//"))
    ]

    assert loaded == []
    assert len(pages) > len(PAGES)
    assert [path.name for path, text in pages.items() if "arithmatex" in text] == []
    assert "<math" in (site / "concepts" / "cooperation.html").read_text(encoding="utf-8")


def copy_sources(folder: Path) -> None:
    """Copy what the site is made from."""
    for name in ("docs", "examples"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "mkdocs.yml", folder)


@pytest.mark.slow
def test_links_lead_to_other_files_of_the_repository_and_back(tmp_path: Path) -> None:
    copy_sources(tmp_path)
    links = "[a script](../solve.py) [data](data.bin) [back](../../docs/glossary.md#sources)"
    (tmp_path / "examples" / "more").mkdir()
    (tmp_path / "examples" / "more" / "README.md").write_text(f"# More\n\n{links}\n", encoding="utf-8")
    (tmp_path / "examples" / "more" / "data.bin").write_bytes(b"\x00\x01")
    with (tmp_path / "docs" / "guides" / "install.md").open("a", encoding="utf-8") as file:
        file.write("\n[more](../../examples/more/README.md)\n")

    run = build(tmp_path, tmp_path / "site")

    assert run.returncode == 0, run.stdout + run.stderr
    more = tmp_path / "site" / "files" / "examples" / "more"
    page = (more / "index.html").read_text(encoding="utf-8")
    assert [
        link for link in ("../solve.py.html", "data.bin", "../../../glossary.html#sources") if link not in page
    ] == []
    assert (more / "data.bin").read_bytes() == b"\x00\x01"
    assert "write_run" in (more.parent / "solve.py.html").read_text(encoding="utf-8")
    install = (tmp_path / "site" / "guides" / "install.html").read_text(encoding="utf-8")
    assert '"../files/examples/more/index.html"' in install


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "text", "warning"),
    [
        ("glossary.md", "[here](nothing.md)", "'nothing.md'"),
        ("glossary.md", "[here](index.md#no-such-heading)", "'#no-such-heading'"),
        ("forgotten.md", "# A page in no list", "forgotten.md"),
    ],
)
def test_a_link_to_nowhere_and_a_forgotten_page_end_the_build(
    tmp_path: Path, page: str, text: str, warning: str
) -> None:
    copy_sources(tmp_path)
    with (tmp_path / "docs" / page).open("a", encoding="utf-8") as file:
        file.write(f"\n{text}\n")

    run = build(tmp_path, tmp_path / "site")

    assert run.returncode == 1
    assert warning in run.stdout + run.stderr
    assert "Aborted with 1 warnings in strict mode" in run.stdout + run.stderr


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_pages_open_from_disk_without_errors_and_fit_the_window(
    site: Path, browser: Browser, width: int, theme: str
) -> None:
    for name in ("index", "tutorial", "concepts/cooperation", "comparison", "troubleshooting", "reference/cell-file"):
        show(browser, site / f"{name}.html", (width, 900), theme)

        assert browser.console == [], name
        assert browser.run("return document.documentElement.scrollWidth") <= width, name
        scheme = browser.run("return document.body.dataset.mdColorScheme")
        assert scheme == {"light": "default", "dark": "slate"}[theme]


@pytest.mark.slow
def test_the_search_works_from_disk(site: Path, browser: Browser) -> None:
    show(browser, site / "index.html", (1280, 900), "light")

    hits = browser.run(
        """
        const field = document.querySelector("[data-md-component=search-query]");
        field.focus();
        field.value = "cooperation Jacobian";
        field.dispatchEvent(new KeyboardEvent("keyup"));
        field.dispatchEvent(new Event("input", {bubbles: true}));
        for (let i = 0; i < 200; i += 1) {
          const links = [...document.querySelectorAll(".md-search-result__link")].map((link) => link.href);
          if (links.length > 0) return links;
          await new Promise((go) => setTimeout(go, 50));
        }
        return [];
        """
    )

    assert any("concepts/cooperation.html" in link for link in hits)
    assert browser.console == []
