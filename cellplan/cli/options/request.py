"""Options of a command, each declared once: as a field of a frozen class, with its names and its help in its type."""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from inspect import Parameter, get_annotations
from typing import Annotated, Any, ClassVar, TypeVar, get_args, get_origin, get_type_hints

import typer

Request = TypeVar("Request")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Arguments and options of a command: the fields of a class in the order of the help, before those of its base."""

    SCHEMA: ClassVar[str] = ""  # of the JSON object that the command prints

    @property
    def schema(self) -> str:
        """Schema of the JSON object with these options."""
        return self.SCHEMA

    def to(self, kind: type[Request], **others: Any) -> Request:
        """The request of a job: its fields are the options of the same names, and others that the options lack."""
        names = {field.name for field in fields(self)}
        shared = {field.name: getattr(self, field.name) for field in fields(kind) if field.name in names}  # type: ignore[arg-type]
        return kind(**{**shared, **others})


def option(spelling: str, meaning: str, **rules: Any) -> Any:
    """An option as its help shows it: ``option("-o, --output DIR", "Run folder.")``; a flag takes no value."""
    *names, last = spelling.split(", ")
    name, _, value = last.partition(" ")
    return typer.Option(*names, name, metavar=value or None, help=meaning, **rules)


def argument(value: str, meaning: str, **rules: Any) -> Any:
    """An argument as its help shows it: ``argument("CELL", "Cell file.")``."""
    return typer.Argument(metavar=value, help=meaning, **rules)


def parameters(kind: type[Options]) -> Iterator[Parameter]:
    """The fields of a class of options as parameters of a function, which typer reads.

    A tuple is an option that may be repeated, to typer a list.
    """
    hints = get_type_hints(kind, include_extras=True)
    rank = {name: place for place, base in enumerate(kind.__mro__) for name in get_annotations(base)}
    for field in sorted(fields(kind), key=lambda field: rank[field.name]):
        value, declared = get_args(hints[field.name])
        default = Parameter.empty if field.default is MISSING else field.default
        if get_origin(value) is tuple:
            value, default = list[get_args(value)[0]], default or None  # type: ignore[misc]
        yield Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[value, declared])


def given(kind: type[Request], values: dict[str, Any]) -> Request:
    """The options that typer has read; what was not given keeps its default."""
    stated = {name: value for name, value in values.items() if value is not None}
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in stated.items()})
