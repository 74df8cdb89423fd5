"""Pages of the three publications on which their figures, tables and sections stand, by their own lists of contents."""

import re
from collections.abc import Iterator
from typing import Final

VARGAS, NICOLATO, RIBEIRO = "Vargas, Leite and Costa 2012", "Nicolato 2007", "Ribeiro 2010"
FIGURE, TABLE, SECTION, ALGORITHM = "Fig.", "Tab.", "section", "Alg."
Pages = dict[str, int]  # of a numbered item, or the page on which a section begins


def _pages(text: str) -> Pages:
    """Pages from words of the form ``number:page``."""
    return {name: int(page) for name, _, page in (word.partition(":") for word in text.split())}


def _counted(text: str) -> Pages:
    """Pages of items that are numbered from 1 on."""
    return {str(number): int(page) for number, page in enumerate(text.split(), start=1)}


PAGES: Final[dict[str, dict[str, Pages]]] = {
    VARGAS: {
        FIGURE: _counted("3543 3544 3545 3546 3546 3546 3546 3546 3547 3547 3547 3547 3547 3547 3548"),
        SECTION: _pages("4.1:3545 4.2:3546 4.3:3546 5:3547"),
    },
    NICOLATO: {
        FIGURE: _pages(
            "2.1:16 3.1:26 3.2:30 3.3:31 3.4:32 4.1:35 4.2:36 4.3:37 4.4:38 4.5:38 4.6:39 4.7:39 4.8:41 4.9:42 4.10:43 "
            "4.11:44 5.1:46 5.2:48 5.3:50 5.4:51 5.5:52 5.6:52 5.7:53 5.8:53 5.9:54 5.10:54 5.11:55 5.12:55 5.13:56 "
            "5.14:57 5.15:58 5.16:58 5.17:59 5.18:59 A.1:70 A.2:71 A.3:71 A.4:72 A.5:72"
        ),
        TABLE: _pages("4.1:34 4.2:40 4.3:42 4.4:43 5.1:57 A.1:73"),
        ALGORITHM: _pages("1:28"),
        SECTION: _pages("3.4:28 3.5:31 4.1:33 4.2:35 4.3:40 4.4:41 5.4.1:51 5.4.2:53 5.4.3:54 5.4.4:56 6:60"),
    },
    RIBEIRO: {
        FIGURE: _counted(
            "7 11 12 14 15 16 19 20 20 20 21 22 26 32 37 38 44 45 49 53 54 64 66 67 70 70 71 72 73 73 75 76 76 77 77 "
            "78 79 80 80 81 81 82 82 83 84 85 86 86 87 88 89 89 90 91 91 92 93 94 94 95 96 96 97 98 98 99 100 100 101 "
            "102 102 103 104 105 106 107 107 118 119 123 124 125 129 131 134 141 142 147 151 153 157 158 162 163 164 "
            "165 166 166 167 172 173 174 174 175 184 184 188 189 189 189 190"
        ),
        TABLE: _counted("7 13 69 70 71 72 72"),
        SECTION: _pages(
            "4.5:58 5.3:68 5.3.1:75 5.3.2:78 5.3.2.1:79 5.3.2.4:83 5.3.2.7:85 5.3.2.8:87 5.3.2.9:87 5.4:88 5.4.1.1:90 "
            "5.4.1.2:92 5.4.1.3:92 5.4.1.4:93 5.4.2.1:95 5.4.2.2:95 5.4.2.3:95 5.4.2.4:97 5.4.3.1:97 5.4.3.2:99 "
            "5.5.1.1:103 5.5.2.1:104 5.5.2.2:105 5.5.3:105 5.5.3.1:105 5.6:106 5.7:109 E.1.7:188"
        ),
    },
}
KINDS: Final = {"Fig": FIGURE, "table": TABLE, "section": SECTION}
NUMBER: Final = r"(?:[A-E]\.)?\d+(?:\.\d+)*"
PLACE: Final = re.compile(rf"(?P<kind>Fig|table|section)s?\.? (?P<numbers>{NUMBER}(?:(?:, | and | to ){NUMBER})*)")


def pages_of(paper: str, where: str) -> list[int]:
    """Pages of everything that a place in a paper names by figure, table or section, each once.

    Raises:
        KeyError: The paper has no such figure, table or section.
    """
    return sorted(
        {
            PAGES[paper][KINDS[match["kind"]]][number]
            for match in PLACE.finditer(where)
            for number in _numbers(match["numbers"])
        }
    )


def with_pages(paper: str, where: str) -> str:
    """A place in a paper followed by its pages; equations alone have none."""
    result = pages_of(paper, where)
    return f"{where}, p. {', '.join(str(page) for page in result)}" if result else where


def _numbers(text: str) -> Iterator[str]:
    """Numbers of a list that may hold ranges, as in ``37 to 39 and 51``."""
    for part in re.split(r", | and ", text):
        first, _, last = part.partition(" to ")
        prefix, dot, low = first.rpartition(".")
        for number in range(int(low), int(last.rpartition(".")[2] or low) + 1):
            yield f"{prefix}{dot}{number}"
