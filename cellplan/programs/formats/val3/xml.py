"""XML of VAL3 files: elements with their lines, refused where a file is no such project, data or program."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat

from cellplan.errors import InputError
from cellplan.geometry.mesh.formats.strict_xml import parse_strictly
from cellplan.programs.elements.text import split_lines

PROJECT_SPACE: Final = "http://www.staubli.com/robotics/VAL3/Project/3"
DATA_SPACE: Final = "http://www.staubli.com/robotics/VAL3/Data/2"
PROGRAM_SPACE: Final = "http://www.staubli.com/robotics/VAL3/Program/2"
PARAMETER_SPACE: Final = "http://www.staubli.com/robotics/VAL3/Param/1"
TYPE_SPACE: Final = "http://www.w3.org/2001/XMLSchema-instance"
TYPE: Final = f"{TYPE_SPACE} type"


@dataclass(slots=True, kw_only=True, eq=False)
class Val3Element:
    """An element of a file."""

    file: str
    line: int  # line of its tag
    space: str  # its namespace
    name: str
    attributes: dict[str, str]  # its attributes; those of a namespace have it before the name
    children: list["Val3Element"] = field(default_factory=list)
    text: str = ""
    text_line: int = 0  # line on which the text begins

    def error(self, expected: str, got: str) -> InputError:
        """An error at its tag."""
        return InputError(f"{self.file}:{self.line}: expected {expected}, got {got[:60]!r}")

    def require(self, *, needed: Collection[str] = (), allowed: Collection[str] = ()) -> None:
        """Make sure that it has the attributes that it needs, and no unknown one."""
        for name in needed:
            if name not in self.attributes:
                raise self.error(f"the attribute {name.rpartition(' ')[2]}", "none")
        for name in self.attributes:
            if name not in needed and name not in allowed:
                raise self.error("no other attributes", name.rpartition(" ")[2])

    def only(self, *names: str) -> list["Val3Element"]:
        """Its elements, which all have one of some names and its own namespace; it has no text."""
        for child in self.children:
            if child.space != self.space or child.name not in names:
                raise child.error(" or ".join(names) or "no element", child.name)
        if self.text.strip():
            raise self.error("no text", self.text.strip())
        return self.children

    def one(self, name: str) -> "Val3Element":
        """The only element, of this name and in its own namespace."""
        matching = [child for child in self.children if (child.space, child.name) == (self.space, name)]
        if len(matching) != 1:
            raise self.error(f"{name} once", f"{len(matching)} of them")
        return matching[0]


def parse(text: str, file: str, root: str, space: str) -> Val3Element:
    """The root element of a text, of this name and namespace; a mark of the byte order before it is left out."""
    split_lines(text, file)  # refuses two kinds of line ends
    parser = expat.ParserCreate(namespace_separator=" ")
    top = Val3Element(file=file, line=1, space="", name="", attributes={})
    open_elements = [top]

    def begin(full_name: str, attributes: dict[str, str]) -> None:
        space, _, name = full_name.rpartition(" ")
        line = parser.CurrentLineNumber
        element = Val3Element(file=file, line=line, space=space, name=name, attributes=attributes)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def finish(_name: str) -> None:
        open_elements.pop()

    def say(said: str) -> None:
        element = open_elements[-1]
        if not element.text:
            element.text_line = parser.CurrentLineNumber
        element.text += said

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, finish, say
    parse_strictly(parser, text.removeprefix("\ufeff").encode(errors="surrogatepass"), file)
    element = top.children[0]
    if (element.space, element.name) != (space, root):
        raise element.error(f"{root} of the namespace {space}", f"{element.space} {element.name}".strip())
    return element
