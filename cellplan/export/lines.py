"""Lines of a text with one kind of line end."""

from cellplan.errors import InputError


def split_lines(text: str, file: str) -> list[str]:
    """Lines without their ends, which are all like the first one; what follows the last one comes last.

    Raises:
        InputError: With file and line, where a line ends otherwise.
    """
    parts = text.split("\n")
    crossed = [part.endswith("\r") for part in parts[:-1]]
    for number, (part, is_crossed) in enumerate(zip(parts[:-1], crossed, strict=True), start=1):
        if is_crossed != crossed[0] or "\r" in part.removesuffix("\r"):
            raise InputError(f"{file}:{number}: expected one kind of line end, got two")
    if "\r" in parts[-1]:
        raise InputError(f"{file}:{len(parts)}: expected one kind of line end, got two")
    return [*(part.removesuffix("\r") for part in parts[:-1]), parts[-1]]
