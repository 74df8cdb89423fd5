"""Findings of the file format in plain words: pydantic's findings, told as where, what, got and allowed."""

import re
from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError

from cellplan.io.input.findings import Finding, KeyPath, did_you_mean, listed, shown
from cellplan.io.schema.common import NAME_WORDS, Entry
from cellplan.io.yaml.reader import YamlDocument

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
FINDING_LIMIT: Final = 1000  # findings that are told; a file with more is not corrected line by line
TAG: Final = re.compile(r"<.*>")


AnyEntry = TypeVar("AnyEntry", bound=Entry)


def validate(model: type[AnyEntry], document: YamlDocument) -> tuple[AnyEntry | None, list[Finding]]:
    """Read a whole file.

    Args:
        model: What should stand there.
        document: The file.

    Returns:
        The entry, or None when there are findings; and the findings that the YAML reader has not made already.
    """
    try:
        return model.model_validate(document.root), []
    except ValidationError as error:
        findings = error.errors(include_url=False, include_context=True, include_input=False)
    told = [_Finding(model, document, dict(finding)).finding() for finding in findings[:FINDING_LIMIT]]
    return None, [finding for finding in dict.fromkeys(told) if finding is not None]


def understood(model: type[AnyEntry], document: YamlDocument, path: KeyPath) -> AnyEntry | None:
    """One part of a file; None when it is not as it should be."""
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


class _Finding:
    """One finding of pydantic, with its place in the file and in the format."""

    def __init__(self, model: type[Entry], document: YamlDocument, finding: dict[str, Any]) -> None:
        """Take the finding apart."""
        location = tuple(finding["loc"])
        self.model = model
        self.document = document
        self.is_key = location[-1:] == ("[key]",)
        self.location: KeyPath = location[:-1] if self.is_key else location
        self.path: KeyPath = tuple(key for key in self.location if not TAG.fullmatch(str(key)))
        self.kind: str = finding["type"]
        self.text: str = finding["msg"]
        self.context: dict[str, Any] = finding.get("ctx", {})

    def finding(self) -> Finding | None:
        """The finding in plain words; None when the reader has complained about this value already."""
        if any(self.path[: n + 1] in self.document.unreadable for n in range(len(self.path))):
            return None
        if self.is_key:
            return self.document.key_finding(self.path, f"expected {NAME_WORDS}, got {shown(self.path[-1])}")
        if self.kind == "extra_forbidden":
            return self.document.key_finding(self.path, self._unknown_key())
        return self._rule() if self.kind == "rule" else self._value()

    def _value(self) -> Finding | None:
        """Finding about a value that is absent or not allowed."""
        if self.kind == "too_short" and len(value_at(self.document.root, self.path)) >= self.context["min_length"]:
            return None  # short only of entries that are wrong themselves
        if self.kind != "missing":
            return self._about(self.path, self._allowed())
        if isinstance(self.path[-1], int):
            return self._about(self.path[:-1], self._expected(self.location[:-1]))
        return self.document.finding(self.path, f"missing, expected {self._description()}")

    def _about(self, path: KeyPath, expected: str) -> Finding:
        """Finding about a value: expected, got."""
        value = value_at(self.document.root, path)
        is_word = isinstance(value, str) and self.kind == "literal_error"
        hint = did_you_mean(value, _words(expected)) if is_word else ""
        got = str(len(value)) if expected.startswith("at ") and isinstance(value, dict | tuple) else shown(value)
        return self.document.finding(path, f"expected {expected}, got {got}{hint}")

    def _rule(self) -> Finding:
        """Finding of a rule between several keys."""
        path = self.path
        for key in re.findall(r"[^.\[\]]+", self.context["key"]):
            path = (*path, int(key) if key.isdigit() else key)
        text = self.context["text"]
        if text.startswith("unexpected key"):
            return self.document.key_finding(path, text)
        return self.document.finding(path, text)

    def _unknown_key(self) -> str:
        """What to say about a key that nobody knows."""
        allowed = list(fields_of(annotation_at(self.model, self.location[:-1])))
        return f"unknown key{did_you_mean(str(self.path[-1]), allowed)}; allowed: {listed(allowed)}"

    def _description(self) -> str:
        """What a missing key is for."""
        fields = fields_of(annotation_at(self.model, self.location[:-1]))
        words = fields[str(self.location[-1])].description or "a value"
        first = words.rstrip(".")
        return first if first[:2].isupper() else first[:1].lower() + first[1:]

    def _allowed(self) -> str:
        """What may stand here, by the kind of finding."""
        branch = str(self.location[-1]) if self.location else ""
        if self.kind == "choice":
            return self.text
        if TAG.fullmatch(branch) and self.kind in {"literal_error", "string_type"}:
            return branch[1:-1]
        if self.kind in {"too_short", "too_long"} and not _is_fixed_list(annotation_at(self.model, self.location)):
            return self._count()
        if self.kind == "string_pattern_mismatch":
            return NAME_WORDS
        if self.kind in {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}:
            return self._bound()
        return self._expected(self.location)

    def _count(self) -> str:
        """How many entries are allowed."""
        is_short = self.kind == "too_short"
        bound = self.context["min_length" if is_short else "max_length"]
        return f"at {'least' if is_short else 'most'} {bound} {'entry' if bound == 1 else 'entries'}"

    def _bound(self) -> str:
        """A number and its bound, with the unit that the key names."""
        number = f"number{self._unit()}"
        value = value_at(self.document.root, self.path)
        lower = self.context.get("gt", self.context.get("ge"))
        if lower is not None and lower >= 0.0 and value <= 0.0 and not (lower == 0.0 and "ge" in self.context):
            return f"a positive {number}"
        if lower is not None:
            return f"a {number} of at least {shown(lower)}"
        upper = self.context.get("le", self.context.get("lt"))
        return f"a {number} of at most {shown(upper)}" if upper is not None else f"a finite {number}"

    def _unit(self) -> str:
        """`` of millimetres``, from the ending of the nearest key."""
        key = next((key for key in reversed(self.path) if isinstance(key, str)), "")
        unit = next((unit for ending, unit in UNITS.items() if key.endswith(ending)), None)
        return " per second" if key.endswith("_per_s") else f" of {unit}" if unit else ""

    def _expected(self, location: KeyPath) -> str:
        """What the format wants at a place."""
        annotation = annotation_at(self.model, location)
        is_number = annotation is float
        return f"a number{self._unit()}" if is_number else _phrase(annotation)


def _words(expected: str) -> list[str]:
    """Single words named in a phrase, for "did you mean"; what follows "or a" or "or {" is not a word."""
    return re.split(", | or ", re.split(" or a | or [{]", expected)[0])


def fields_of(annotation: Any) -> Mapping[str, Any]:
    """Fields of an entry; none of anything else."""
    return annotation.model_fields if isinstance(annotation, type) and issubclass(annotation, BaseModel) else {}


def _bare(annotation: Any) -> Any:
    """Annotation without metadata and without "or nothing"."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation = get_args(annotation)[0]
            continue
        arms = [arm for arm in _arms(annotation) if arm is not NoneType]
        if len(arms) != 1 or arms[0] is annotation:
            return annotation
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
    """What may stand at a place, in words."""
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
