"""Mismatches between a file and its format: pydantic's findings in words, located in the file."""

import re
from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError

from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, listed, shown
from cellplan.files.yaml.reader import YamlDocument
from cellplan.model.settings.entry import NAME_WORDS, Entry
from cellplan.model.settings.units import Quantity

UNITS: Final[Mapping[str, str]] = {
    "_deg_s3": "degrees per second³",
    "_deg_s2": "degrees per second²",
    "_deg_s": "degrees per second",
    "_mm_s3": "millimetres per second³",
    "_mm_s2": "millimetres per second²",
    "_mm_s": "millimetres per second",
    "_deg": "degrees",
    "_mm": "millimetres",
    "_s": "seconds",
}  # by the ending of the key, longest first
FINDING_LIMIT: Final = 1000  # findings that are reported; a file with more is not corrected line by line
TAG: Final = re.compile(r"<.*>")
COUNTS: Final = frozenset({"too_short", "too_long"})
BOUNDS: Final = frozenset({"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"})
AnyEntry = TypeVar("AnyEntry", bound=Entry)


def validate(model: type[AnyEntry], document: YamlDocument) -> tuple[AnyEntry | None, list[Finding]]:
    """Read a whole file: the entry, None with findings; and those that the YAML reader has not made already."""
    try:
        return model.model_validate(document.root), []
    except ValidationError as error:
        findings = error.errors(include_url=False, include_context=True, include_input=False)
    located = [_MessageReader(model, document, dict(finding)).finding() for finding in findings[:FINDING_LIMIT]]
    return None, [finding for finding in dict.fromkeys(located) if finding is not None]


def valid_entry(model: type[AnyEntry], document: YamlDocument, path: KeyPath) -> AnyEntry | None:
    """One entry of a file; None when it is invalid."""
    try:
        return model.model_validate(value_at(document.root, path))
    except ValidationError:
        return None


def value_at(root: Any, path: KeyPath) -> Any:
    """Value at a key path; None when there is none."""
    for key in path:
        try:
            root = root[key]
        except (KeyError, IndexError, TypeError):
            return None
    return root


class _MessageReader:
    """Reads one finding of pydantic, with its place in the file and in the format."""

    def __init__(self, model: type[Entry], document: YamlDocument, finding: Mapping[str, Any]) -> None:
        """Split the finding into its place and its kind."""
        location = tuple(finding["loc"])
        self.model = model
        self.document = document
        self.is_key = location[-1:] == ("[key]",)
        self.location: KeyPath = location[:-1] if self.is_key else location
        self.path: KeyPath = tuple(key for key in self.location if not TAG.fullmatch(str(key)))
        self.type: str = finding["type"]
        self.text: str = finding["msg"]
        self.context: dict[str, Any] = finding.get("ctx", {})

    @property
    def value(self) -> Any:
        """The value at the place of the finding."""
        return value_at(self.document.root, self.path)

    def finding(self) -> Finding | None:
        """The finding in words, at its line: that of the key where the key is wrong, else of the value.

        None when another one about the same value says more.
        """
        at_value, at_key = self.document.finding, self.document.key_finding
        if any(self.path[: n + 1] in self.document.unreadable for n in range(len(self.path))):
            return None
        if self.is_key and self.type != "rule":
            return at_key(self.path, f"expected {NAME_WORDS}, got {shown(self.path[-1])}")
        if self.type == "extra_forbidden":
            allowed = tuple(fields_of(annotation_at(self.model, self.location[:-1])))
            hint = did_you_mean(str(self.path[-1]), allowed)
            return at_key(self.path, f"unknown key{hint}; allowed: {listed(allowed)}")
        if self.type == "rule":
            text, below = self.context["text"], re.findall(r"[^.\[\]]+", self.context["key"])
            path = (*self.path, *(int(key) if key.isdigit() else key for key in below))
            return (at_key if text.startswith("unexpected key") else at_value)(path, text)
        if self.type == "too_short" and len(self.value) >= self.context["min_length"]:
            return None  # short only of entries that are wrong themselves
        return self._missing() if self.type == "missing" else at_value(self.path, self._about_value())

    def _missing(self) -> Finding:
        """A key or an element of a list of fixed length that is absent."""
        if isinstance(self.path[-1], int):
            path = self.path[:-1]
            got = shown(value_at(self.document.root, path))
            return self.document.finding(path, f"expected {self._type(self.location[:-1])}, got {got}")
        fields = fields_of(annotation_at(self.model, self.location[:-1]))
        words = (fields[str(self.location[-1])].description or "a value").rstrip(".")
        expected = words if words[:2].isupper() else words[:1].lower() + words[1:]
        return self.document.finding(self.path, f"missing, expected {expected}")

    def _about_value(self) -> str:
        """What is expected instead of a value that is not allowed, what was found, and the nearest allowed word."""
        value, hint = self.value, ""
        if self.type in COUNTS and not _is_fixed_list(annotation_at(self.model, self.location)):
            got = str(len(value)) if isinstance(value, dict | tuple) else shown(value)
            return f"expected {self._count()}, got {got}"
        expected = self._expected()
        if self.type == "literal_error" and isinstance(value, str):
            hint = did_you_mean(value, _words(expected))
        return f"expected {expected}, got {shown(value)}{hint}"

    def _expected(self) -> str:
        """The values allowed at the place, as a phrase."""
        branch = str(self.location[-1]) if self.location else ""
        if self.type == "choice":
            return self.text
        if TAG.fullmatch(branch) and self.type in {"literal_error", "string_type"}:
            return branch[1:-1]
        if self.type == "string_pattern_mismatch":
            return NAME_WORDS
        return self._bound() if self.type in BOUNDS else self._type(self.location)

    def _count(self) -> str:
        """How many entries there may be."""
        least = self.context.get("min_length")
        side, bound = ("most", self.context.get("max_length")) if least is None else ("least", least)
        return f"at {side} {bound} {'entry' if bound == 1 else 'entries'}"

    def _bound(self) -> str:
        """The numbers within bounds, or those that are finite."""
        lower, upper = (self.context.get(key, self.context.get(other)) for key, other in (("gt", "ge"), ("le", "lt")))
        number = f"number{self._unit()}"
        if lower is not None:
            is_positive = lower >= 0.0 >= self.value and not (lower == 0.0 and "ge" in self.context)
            return f"a positive {number}" if is_positive else f"a {number} of at least {shown(lower)}"
        return f"a finite {number}" if upper is None else f"a {number} of at most {shown(upper)}"

    def _unit(self) -> str:
        """`` of millimetres``, from the ending of the nearest key."""
        key = next((key for key in reversed(self.path) if isinstance(key, str)), "")
        unit = next((unit for ending, unit in UNITS.items() if key.endswith(ending)), None)
        return " per second" if key.endswith("_per_s") else f" of {unit}" if unit else ""

    def _type(self, location: KeyPath) -> str:
        """The type of value that the format has at a place."""
        annotation = annotation_at(self.model, location)
        return f"a number{self._unit()}" if annotation is float else _phrase(annotation)


def _words(expected: str) -> list[str]:
    """Single words named in a phrase, for "did you mean"; what follows "or a" or "or {" is not a word."""
    return re.split(", | or ", re.split(" or a | or [{]", expected)[0])


def fields_of(annotation: Any) -> Mapping[str, Any]:
    """Fields of an entry by key; none of anything else."""
    is_entry = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return {field.alias or name: field for name, field in annotation.model_fields.items()} if is_entry else {}


def _bare(annotation: Any) -> Any:
    """Annotation without metadata, without "or nothing" and without the unit of a number."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation = get_args(annotation)[0]
            continue
        arms = [arm for arm in _arms(annotation) if arm is not NoneType]
        if len(arms) != 1 or arms[0] is annotation:
            return float if isinstance(annotation, type) and issubclass(annotation, Quantity) else annotation
        annotation = arms[0]


def _arms(annotation: Any) -> tuple[Any, ...]:
    """Members of a union; the annotation itself when it is none."""
    return get_args(annotation) if get_origin(annotation) in {Union, UnionType} else (annotation,)


def _tagged_arms(annotation: Any) -> dict[str, Any]:
    """Branches of a tagged choice by tag, through nested unions."""
    branches: dict[str, Any] = {}
    if get_origin(annotation) is Annotated:
        inner, *metadata = get_args(annotation)
        tag = next((item.tag for item in metadata if isinstance(item, Tag)), None)
        return {tag: inner} if tag is not None else _tagged_arms(inner)
    for arm in _arms(annotation):
        if arm is not annotation:
            branches.update(_tagged_arms(arm))
    return branches


def annotation_at(annotation: Any, location: KeyPath) -> Any:
    """What the format says about a place."""
    for key in location:
        if TAG.fullmatch(str(key)):
            annotation = _tagged_arms(annotation).get(str(key))
            continue
        annotation = _bare(annotation)
        if fields := fields_of(annotation):
            annotation = fields[str(key)].annotation if str(key) in fields else None
        elif get_origin(annotation) is dict:
            annotation = get_args(annotation)[1]
        elif get_origin(annotation) is tuple:
            arms = get_args(annotation)
            annotation = arms[0] if arms[-1] is Ellipsis else arms[min(int(key), len(arms) - 1)]
    return _bare(annotation)


def _is_fixed_list(annotation: Any) -> bool:
    """Whether a list has a fixed number of items."""
    return get_origin(annotation) is tuple and get_args(annotation)[-1] is not Ellipsis


def _phrase(annotation: Any) -> str:
    """The kinds of value allowed at a place, as a phrase."""
    if get_origin(annotation) is Literal:
        words = [str(word) for word in get_args(annotation)]
        return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
    if get_origin(annotation) is tuple:
        arms = get_args(annotation)
        items = {float: "numbers", str: "texts"}.get(_bare(arms[0]), "entries")
        return f"a list of {items}" if arms[-1] is Ellipsis else f"a list of {len(arms)} {items}"
    if fields := fields_of(annotation):
        return f"a mapping with keys out of {', '.join(fields)}"
    kinds = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    return kinds.get(annotation, "a mapping")
