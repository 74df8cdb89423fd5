"""XML without document types and entities, which can blow up a file or read others; errors as one located line."""

from xml.parsers import expat

from cellplan.errors import InputError


def parse_strictly(parser: expat.XMLParserType, data: bytes, file: str) -> None:
    """Run a parser, whose handlers are set, over well-formed XML of a known encoding without types and entities."""

    def refuse(*_declared: object) -> None:
        line = parser.CurrentLineNumber
        raise InputError(f"{file}:{line}: expected plain XML, got a document type or an entity declaration")

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"{file}:{error.lineno}: expected well-formed XML, got: {reason}") from None
    except (LookupError, ValueError) as error:
        raise InputError(f"{file}: expected XML in a known encoding: {printable(str(error))}") from None


def printable(text: str, length: int = 40) -> str:
    """Text of a foreign file that is safe to print."""
    return text[:length].encode("ascii", errors="backslashreplace").decode().translate(dict.fromkeys(range(32), " "))
