"""Write the reference of the Python API from the docstrings: ``python docs/make_api_reference.py``."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cellplan

PAGE = Path(__file__).resolve().parent / "reference" / "api.md"
INTRODUCTION = """\
# The Python API

This page is made from the docstrings by `docs/make_api_reference.py`; do not edit it by hand. The guide
[From Python](../guides/from-python.md) shows how the names are used together, and `examples/` has scripts that run.

These names are the public interface, as in `cellplan.__all__`; anything else may change without notice. All values are
frozen data in metres, radians and seconds. `Array` is a NumPy array of 64-bit floating-point numbers.
"""
CODE_LINE = 120  # characters in a line of a signature


def main() -> None:
    """Write the page."""
    PAGE.write_text(api_reference(), encoding="utf-8")


def api_reference() -> str:
    """Text of the page about the Python API: functions first, then classes, each in alphabetical order."""
    public = {name: getattr(cellplan, name) for name in cellplan.__all__ if not name.startswith("__")}
    functions = [name for name, value in public.items() if inspect.isfunction(value)]
    classes = [name for name, value in public.items() if inspect.isclass(value)]
    parts = [INTRODUCTION, "\n## Functions\n", *(function_entry(name, public[name]) for name in functions)]
    return "".join([*parts, "\n## Classes\n", *(class_entry(name, public[name]) for name in classes)])


def function_entry(name: str, function: Any) -> str:
    """Heading, signature and docstring of a function."""
    return (
        f"\n### `{name}`\n\n```text\n{signature(definition(function))}\n```\n\n{prose(inspect.getdoc(function) or '')}"
    )


def class_entry(name: str, cls: type) -> str:
    """Heading and docstring of a class, then its public methods and properties with their first sentence."""
    members = [
        f"- `{signature(node, is_method=True)}`: {first_line(node)}\n"
        for base in (base for base in cls.__mro__ if base.__module__.startswith("cellplan."))
        for node in definition(base).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    ]
    listed = ["\n**Methods and properties**\n\n", *members] if members else []
    return "".join([f"\n### `{name}`\n\n{prose(inspect.getdoc(cls) or '')}", *listed])


def definition(value: Any) -> Any:
    """Syntax tree of a function or class; the text of its annotations is the same in all versions of its libraries."""
    return ast.parse(textwrap.dedent(inspect.getsource(value))).body[0]


def signature(node: ast.FunctionDef, *, is_method: bool = False) -> str:
    """A function as it is called: name, parameters and result; a property by its name and type."""
    returns = ast.unparse(node.returns).strip("'") if node.returns else "None"
    decorators = {ast.unparse(decorator) for decorator in node.decorator_list}
    if decorators & {"property", "cached_property"}:
        return f"{node.name}: {returns}"
    arguments = node.args
    plain = arguments.args[1:] if is_method else arguments.args  # without self or cls
    defaults = [None] * (len(plain) - len(arguments.defaults)) + arguments.defaults
    given = [with_default(*pair) for pair in zip(plain, defaults, strict=True)]
    given += ["*"] if arguments.kwonlyargs else []
    given += [with_default(*pair) for pair in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)]
    line = f"{node.name}({', '.join(given)}) -> {returns}"
    if is_method or len(line) <= CODE_LINE:
        return line
    return "\n".join([f"{node.name}(", *(f"    {text}," for text in given), f") -> {returns}"])


def with_default(argument: ast.arg, default: ast.expr | None) -> str:
    """A parameter with its default."""
    return ast.unparse(argument) + (f" = {ast.unparse(default)}" if default is not None else "")


def first_line(node: ast.FunctionDef) -> str:
    """First sentence of a docstring."""
    return markup((ast.get_docstring(node) or "").partition("\n")[0])


def prose(docstring: str) -> str:
    """A docstring in Google style as Markdown: sections become lists."""
    return "".join(f"{line}\n" for line in _lines(docstring))


def _lines(docstring: str) -> Iterator[str]:
    is_list = False
    for line in docstring.splitlines():
        if line in ("Args:", "Attributes:", "Raises:", "Returns:"):
            is_list = line != "Returns:"
            yield from (f"**{line.removesuffix(':')}**", "")
        elif is_list and (entry := re.match(r"    (\w+): (.*)", line)):
            yield f"- `{entry[1]}`: {markup(entry[2])}"
        elif is_list and line:
            yield f"  {markup(line.strip())}"
        else:
            yield markup(line.strip())


def markup(text: str) -> str:
    """Literals and citations of a docstring in Markdown."""
    return re.sub(r"\[(\w+)\]_", r"[\1]", text.replace("``", "`"))


if __name__ == "__main__":
    main()
