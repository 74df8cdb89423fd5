"""The page of the live cell as text: nothing inline, nothing of a cell, and every element that its scripts name."""

import re
from collections import Counter

import pytest

from cellplan.cli.edit.page.texts import page_texts

TEXTS = {address: text for address, (_, text) in page_texts().items()}
IDS = re.findall(r'\bid="([^"]+)"', TEXTS["/"])


def test_nothing_is_inline_and_nothing_comes_from_elsewhere() -> None:
    page = TEXTS["/"]

    assert re.findall(r"<script\b[^>]*>([^<]*)</script>", page) == [""]
    assert "<style" not in page
    assert re.findall(r"\s(?:style|on\w+)=", page) == []
    assert re.findall(r'(?:src|href)="([^"]+)"', page) == ["data:,", "/edit.css", "/edit.js"]
    assert [text for text in TEXTS.values() if re.search(r"(?:url\(|@import|https?://(?!www\.w3\.org))", text)] == []


@pytest.mark.parametrize(
    "banned", ["innerHTML", "eval(", "insertAdjacentHTML", "document.write", 'setAttribute("style"']
)
def test_no_text_becomes_markup_or_script(banned: str) -> None:
    assert banned not in TEXTS["/edit.js"]


def test_every_element_that_the_scripts_name_is_in_the_page_once() -> None:
    named = set(re.findall(r'byId\("([\w-]+)"\)', TEXTS["/edit.js"]))

    assert [name for name, count in Counter(IDS).items() if count > 1] == []
    assert sorted(named - set(IDS)) == []


def test_scripts_share_no_name() -> None:
    pattern = r"^(?:async )?(?:const|let|function|class) (\w+)"
    names = Counter(re.findall(pattern, TEXTS["/edit.js"], re.MULTILINE))

    assert [name for name, count in names.items() if count > 1] == []
