"""Scripts of a page run, and no others; its links lead to files of the run."""

import re
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from cellplan.cli.main import run
from cellplan.report.page.render import file_links, page_scripts


class Parts(HTMLParser):
    """Text of each script, and every address, of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.scripts: list[str] = []
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "script":
            self.scripts.append("")
        self.addresses += [value or "" for name, value in attrs if name in ("href", "src")]

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script":
            self.scripts[-1] += data


def test_the_policy_of_a_page_allows_the_scripts_in_it_and_no_others(sound: Path) -> None:
    page = (sound / "run" / "report.html").read_text(encoding="utf-8")

    (policy,) = re.findall(r"script-src ([^\";]*)", page)
    digests = [b64encode(sha256(text.encode()).digest()).decode() for text in Parts(page).scripts]

    assert digests
    assert policy.split() == [f"'sha256-{digest}'" for digest in digests]


def test_every_script_has_a_source_of_its_own() -> None:
    assert page_scripts([]).policy == ""
    assert page_scripts(["a();"]).policy in page_scripts(["a();", "b();"]).policy


@pytest.mark.parametrize("mode", ["simultaneous", "pairwise"])
def test_links_lead_to_files_of_the_run_and_to_each_of_its_tables(sound: Path, tmp_path: Path, mode: str) -> None:
    folder = sound / "run"
    if mode == "pairwise":
        folder = tmp_path / "run"
        assert run(["solve", str(sound / "cell" / "small.yaml"), "-q", "--mode", mode, "-o", str(folder)]) == 0
    pages = [folder / "report.html", *folder.glob("*/report.html")]

    for page in pages:
        addresses = Parts(page.read_text(encoding="utf-8")).addresses
        result = [link.split("#")[0] for link in addresses if not link.startswith("#")]
        files = {(page.parent / unquote(link)).resolve() for link in result}
        assert [link for link in result if not (page.parent / unquote(link)).is_file()] == []
        assert {folder.resolve() / "view.html", *folder.resolve().glob("tables/*.csv")} <= files
        assert {folder.resolve() / name for name in ("report.json", "cell.yaml", "manifest.json")} - files <= (
            {folder.resolve() / "report.json"} if page.parent != folder else set()
        )


def test_names_that_are_no_addresses_are_quoted() -> None:
    links = file_links(["tables/a b%#.csv", "rejected/x.csv"], ["t?.svg"], ["report.json"], phase="p")

    assert links["Joint tables"] == [("a b%#", "../tables/a%20b%25%23.csv")]
    assert links["Joint tables of a failed run, not for use"] == [("x", "../rejected/x.csv")]
    assert links["Plots"] == [("t?", "plots/t%3F.svg")]
    assert [address for _, address in links["Results"]] == ["report.json", "../cell.yaml", "../manifest.json"]
