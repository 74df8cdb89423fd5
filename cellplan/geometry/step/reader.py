"""Solids of a STEP file with their names, at their places in its assembly."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from cellplan.errors import InputError
from cellplan.geometry.step.kernel import Solid, explored
from cellplan.geometry.step.part21 import MAX_BYTES, Exchange, scan

NO_NAMES: Final = frozenset({"", "NONE", "SOLID", "COMPOUND", "SHELL", "COMPSOLID"})  # what programs write for no name
GENERATED: Final = ("Open CASCADE STEP translator", "=>[")  # beginnings of names that no person has chosen
MOST_SOLIDS: Final = 200
MOST_LISTED: Final = 12  # names in a message
BREPS: Final = ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP")


class UnknownShapeError(InputError):
    """A STEP file has no shape of that name."""


class StepContent(NamedTuple):
    """The solids that were chosen from a STEP file, and what else it holds, with counts."""

    solids: list[Solid]
    unused: list[str]


class _Leaf(NamedTuple):
    """A shape of an assembly that is no assembly: names on the way to it, its label and its location."""

    path: tuple[str, ...]
    label: Any
    location: Any


def read_solids(path: Path, file: str, shape: str | None) -> StepContent:
    """Solids of a STEP file in its own frame, or those of one of its assemblies, parts or solids by name.

    Raises:
        InputError: The file cannot be read, is damaged, holds no solid or an unsound one, or nothing of that name.
    """
    exchange = scan(_text(path, file), file)
    tool = _transferred(path, file, exchange)
    leaves = [leaf for label in _labels(tool.GetFreeShapes) for leaf in _leaves(label)]
    solids: list[Solid] = []
    others: dict[str, int] = {}
    known: dict[str, None] = {}
    left_out = 0
    for leaf in leaves:
        for name, solid in _solids(leaf, others):
            names = (*leaf.path, name)
            known.update(dict.fromkeys(names))
            if shape is not None and shape not in names:
                left_out += 1
                continue
            if len(solids) == MOST_SOLIDS:
                raise InputError(f"{file}: expected at most {MOST_SOLIDS} solids, got more; choose some with shape")
            solids.append(Solid(solid, name, _names(leaf)))
    if not solids and shape is not None and known:
        listed = ", ".join(list(known)[:MOST_LISTED])
        raise UnknownShapeError(f"expected the name of a shape in {file}, got '{shape}'; it has {listed}")
    if not solids:
        got = ", ".join(f"{count} {kind}" for kind, count in others.items()) or "none"
        raise InputError(f"{file}: expected at least one solid, got {got}; export the part as a solid")
    unused = [f"{kind} that belong to no solid ({count})" for kind, count in others.items()]
    unused += [f"solids beside {shape} ({left_out})"] if left_out else []
    return StepContent(_distinct(solids), [*unused, *exchange.unread])


def _text(path: Path, file: str) -> str:
    """Text of the file; its texts are ASCII or, from careless programs, Latin-1."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(
                f"{file}: expected at most {MAX_BYTES // 10**6} MB, got {path.stat().st_size / 1e6:.0f} MB"
            )
        return path.read_bytes().decode("latin-1")
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {(error.strerror or '').lower()}") from None


def _transferred(path: Path, file: str, exchange: Exchange) -> Any:
    """The shape tool of a document that holds all of the file."""
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Interface import Interface_Static
    from OCP.Message import Message
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = STEPCAFControl_Reader()
    Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    reader.SetNameMode(True)
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    is_read = reader.ReadFile(str(path)) == IFSelect_RetDone and reader.Transfer(document)
    session = reader.Reader().WS()
    _refuse_failures(session, file, exchange)
    if not is_read:
        raise InputError(f"{file}: expected shapes that can be built, got a file whose content gives none")
    expected = sum(exchange.counts[name] for name in BREPS)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    _DOCUMENTS.append(document)  # labels are valid as long as their document is
    return _complete(tool, expected, file)


_DOCUMENTS: Final[list[Any]] = []


def _complete(tool: Any, expected: int, file: str) -> Any:
    """The shape tool, after its solids were counted against the text of the file."""
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    shapes = [XCAFDoc_ShapeTool.GetShape_s(label) for label in _labels(tool.GetShapes) if _is_simple(label)]
    count = len(
        {hash(solid.Located(solid.Location().__class__())) for it in shapes for solid in explored(it, TopAbs_SOLID)}
    )
    if count < expected:
        raise InputError(f"{file}: expected the {expected} solids that the file states, got {count} that can be built")
    return tool


def _is_simple(label: Any) -> bool:
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    return bool(XCAFDoc_ShapeTool.IsSimpleShape_s(label))


def _refuse_failures(session: Any, file: str, exchange: Exchange) -> None:
    """Refuse a file of which an entity cannot be understood or built, with the first one."""
    numbers = list(exchange.lines)  # the library counts the entities in the order of the file
    for checks in (session.ModelCheckList(False), session.TransferReader().LastCheckList()):
        checks.Start()
        while checks.More():
            check, number = checks.Value(), checks.Number()
            if check.NbFails() and 0 < number <= len(numbers):
                entity, words = numbers[number - 1], " ".join(str(check.CFail(1, True)).split())
                text = f"#{entity}: expected an entity that can be built, got one of which is said: {words}"
                raise InputError(f"{file}:{exchange.lines[entity]}: {text}")
            checks.Next()


def _labels(fill: Any, *arguments: Any) -> list[Any]:
    """Labels that a function of the library lists."""
    from OCP.collections import Sequence_TDF_Label

    labels = Sequence_TDF_Label()
    fill(*arguments, labels)
    return [labels.Value(place + 1) for place in range(labels.Length())]


def _leaves(label: Any, path: tuple[str, ...] = (), location: Any = None) -> Iterator[_Leaf]:
    """All shapes below a label that are no assemblies."""
    from OCP.TDF import TDF_Label
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_ShapeTool as Tool

    here = TopLoc_Location() if location is None else location
    name = _label_name(label)
    path = (*path, name) if name and name not in path else path
    if Tool.IsReference_s(label):
        referred = TDF_Label()
        Tool.GetReferredShape_s(label, referred)
        yield from _leaves(referred, path, here.Multiplied(Tool.GetLocation_s(label)))
    elif Tool.IsAssembly_s(label):
        for component in _labels(Tool.GetComponents_s, label):
            yield from _leaves(component, path, here)
    else:
        yield _Leaf(path, label, here)


def _label_name(label: Any) -> str:
    """Name of a label that somebody chose; empty where there is none."""
    from OCP.TDataStd import TDataStd_Name

    attribute = TDataStd_Name()
    name = str(attribute.Get().ToExtString()).strip() if label.FindAttribute(TDataStd_Name.GetID_s(), attribute) else ""
    return "" if name.upper() in NO_NAMES or name.startswith(GENERATED) else name


def _solids(leaf: _Leaf, others: dict[str, int]) -> Iterator[tuple[str, Any]]:
    """Solids of a leaf at their places with their names; what belongs to no solid is counted."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID, TopAbs_VERTEX, TopAbs_WIRE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS
    from OCP.XCAFDoc import XCAFDoc_ShapeTool

    shape = XCAFDoc_ShapeTool.GetShape_s(leaf.label).Moved(leaf.location)
    names, base = _names(leaf), leaf.path[-1] if leaf.path else "PART"
    solids = [TopoDS.Solid(solid) for solid in explored(shape, TopAbs_SOLID)]
    for place, solid in enumerate(solids, start=1):
        yield names.get(hash(solid)) or (base if len(solids) == 1 else f"{base}_{place}"), solid
    levels = ((TopAbs_FACE, TopAbs_SOLID, "faces"), (TopAbs_WIRE, TopAbs_FACE, "wires"))
    for kind, outside, words in (*levels, (TopAbs_EDGE, TopAbs_WIRE, "edges"), (TopAbs_VERTEX, TopAbs_EDGE, "points")):
        explorer = TopExp_Explorer(shape, kind, outside)
        while explorer.More():
            others[words] = others.get(words, 0) + 1
            explorer.Next()


def _names(leaf: _Leaf) -> dict[int, str]:
    """Names of what a leaf consists of, by the hash of the shape at its place."""
    from OCP.XCAFDoc import XCAFDoc_ShapeTool as Tool

    named = [(Tool.GetShape_s(label), _label_name(label)) for label in _labels(Tool.GetSubShapes_s, leaf.label)]
    return {hash(shape.Moved(leaf.location)): name for shape, name in named if name}


def _distinct(solids: list[Solid]) -> list[Solid]:
    """Solids whose names differ: those that share one get a number."""
    counts: dict[str, int] = {}
    for solid in solids:
        counts[solid.name] = counts.get(solid.name, 0) + 1
    seen: dict[str, int] = {}
    for solid in solids:
        if counts[solid.name] > 1:
            seen[solid.name] = seen.get(solid.name, 0) + 1
            solid.name = f"{solid.name}_{seen[solid.name]}"
    return solids
