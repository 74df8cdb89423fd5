"""Expressions of a xacro file: Python, but without any way to the objects behind the values.

The evaluation of xacro itself only hides the built-in functions; attributes of any value lead back to them. Here an
attribute is an entry of a table or one of a few methods of plain values, nothing else.
"""

import ast
from collections.abc import Mapping
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.input.findings import shown

REFUSED_SYMBOLS: Final = ("vars", "type")  # of the namespace "python": they lead to the objects behind values
PLAIN: Final = (str, list, tuple, set, dict)
METHODS: Final = frozenset(
    (
        *("append", "capitalize", "copy", "count", "endswith", "extend", "find", "get"),
        *("index", "isalpha", "isdigit", "items", "join", "keys", "lower", "lstrip"),
        *("replace", "rsplit", "rstrip", "split", "startswith", "strip", "title", "upper", "values", "zfill"),
    )
)
ACCESS: Final = "__attribute"  # no name of a file begins with two underscores
LONGEST: Final = 10_000  # characters of an expression


def evaluated(text: str, symbols: dict[str, Any], local: Mapping[str, Any] | None = None) -> Any:
    """Value of an expression.

    Args:
        symbols: Values by name; the access to attributes is added.
        local: Values by name that come first; None for none.

    Raises:
        InputError: The expression does what none in a robot file has to do.
        Exception: Whatever the expression causes.
    """
    if len(text) > LONGEST:
        raise InputError(f"expected an expression of at most {LONGEST} characters, got {len(text)}")
    tree = ast.fix_missing_locations(_Confined().visit(ast.parse(text.strip(), mode="eval")))
    symbols.update(__builtins__={ACCESS: _attribute})
    return eval(compile(tree, "<expression>", "eval"), symbols, local)  # noqa: S307 - of names that are safe to call


class _Confined(ast.NodeTransformer):
    """Replaces each access to an attribute by a call that checks it."""

    def visit_Name(self, node: ast.Name) -> ast.Name:
        """A name is not one of Python's own."""
        if node.id.startswith("__"):
            raise InputError(f"expected no name with two underscores at its start, got {shown(node.id)}")
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.Call:
        """``value.name`` becomes a call."""
        value = self.visit(node.value)
        return ast.Call(ast.Name(ACCESS, ast.Load()), [value, ast.Constant(node.attr)], [])


def _attribute(owner: object, name: str) -> Any:
    """Entry of a table, or method of a plain value."""
    if isinstance(owner, dict) and name in owner and not name.startswith("_"):
        return owner[name]
    if isinstance(owner, PLAIN) and name in METHODS:
        return getattr(owner, name)
    raise InputError(f"expected an entry of a table or a method of text, lists or tables, got {shown('.' + name)}")
