"""Expansion of a xacro file into the elements of a URDF, each with the line of the file in which it was written.

The package ``xacro`` does the work, an extra of the installation. Everything that it reads passes through this module:
included files and YAML lie within the allowed folders, packages are those of the cell, variables of the environment are
not read, and expressions can call nothing but mathematics and the methods of plain values.
"""

import contextlib
import glob
import io
import re
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final
from xml.dom import minidom
from xml.parsers import expat

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders, read_regular_file
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.files.robots.urdf import XACRO_SUFFIX
from cellplan.files.robots.urdf.document.expressions import REFUSED_SYMBOLS, evaluated
from cellplan.files.robots.urdf.document.packages import Packages
from cellplan.files.robots.urdf.document.xml import MAX_BYTES, MAX_DEPTH, Element, Remarks, parse_xml, read_xml

INSTALL: Final = 'pip install "cellplan[xacro]"'
PACKAGE: Final = "/:package:/"  # begins the path of a file in a package, until the file is read
PACKAGE_PATH: Final = re.compile(f"(?:file:/*?)?{PACKAGE}")  # ``file://$(find NAME)/`` and ``file:///$(find NAME)/``
PLACE: Final = "place"  # of a node in its file, kept by copies of the node
LONGEST_REASON: Final = 200  # characters of what xacro says
DECLARED: Final = re.compile(rb"<xacro:arg\s[^>]*?name=[\"']([^\"']+)")
ARGUMENT: Final = re.compile(rb"\$\(arg\s+([^\s)]+)\s*\)")
NAMESPACE: Final = 'xacro needs xmlns:xacro="http://www.ros.org/wiki/xacro" in the root element'
BUILT_IN: Final = frozenset({"open", "eval"})  # of Python, which xacro calls
WARNING: Final = "warning: "  # how xacro begins one


@dataclass(frozen=True, slots=True, kw_only=True)
class XacroSettings:
    """What the cell says about a xacro file."""

    arguments: Mapping[str, str] = field(default_factory=dict)  # values of its arguments by name
    package_dirs: tuple[Path, ...] = ()  # folders in which ``$(find NAME)`` looks for packages
    within: AllowedFolders | None = None  # folders that all files it reads must lie in; None for all
    elsewhere: frozenset[str] = frozenset()  # names of arguments that another file of the robot takes


def read_elements(
    path: Path, settings: XacroSettings | None, remarks: Remarks
) -> tuple[Element, tuple[Path, ...] | None]:
    """The root element of a file, and the files that one called ``.xacro`` includes; None for another file."""
    if path.suffix.lower() == XACRO_SUFFIX:
        return _Expansion(path, settings or XacroSettings(), remarks).run()
    return read_xml(path), None


def argument_names(path: Path) -> frozenset[str]:
    """Names of the arguments that a xacro file takes, as far as they stand in the file itself."""
    text = read_regular_file(path, file=path.name, limit=MAX_BYTES)
    return frozenset(
        name.decode(errors="replace") for pattern in (DECLARED, ARGUMENT) for name in pattern.findall(text)
    )


class _Files:
    """Files that an expansion reads."""

    def __init__(self, path: Path, settings: XacroSettings, remarks: Remarks) -> None:
        """Start with none read."""
        self._path, self._within, self._remarks = path, settings.within, remarks
        self._packages = Packages(folder=path.parent, package_dirs=settings.package_dirs, within=settings.within)
        self.known: dict[Path, None] = {}

    def read(self, filename: str) -> tuple[Path, bytes]:
        """Path and content of a file within the allowed folders; ``FileNotFoundError`` where there is none."""
        path = self.path_of(filename)
        if self._within is not None and not self._within.holds(path):
            what = "expected files below the folder of the cell file"
            raise InputError(f"{what}, got {shown(path.name)} from elsewhere; allow it with --allow-dir")
        if not path.exists():
            raise FileNotFoundError(f"no such file: {filename.removeprefix(PACKAGE)}")
        data = read_regular_file(path, file=path.name, limit=MAX_BYTES)
        self.known[path] = None
        return path, data

    def glob(self, pattern: str) -> list[str]:
        """Files that a pattern means; stands in for the function of Python."""
        start, wild = re.split(r"(?=[*?[])", pattern, maxsplit=1)
        folder = self.path_of(start + "_").parent
        if self._within is not None and not self._within.holds(folder):
            raise InputError(f"expected files below the folder of the cell file, got {shown(pattern)} from elsewhere")
        return glob.glob(f"{folder}/{start.rpartition('/')[2]}{wild}")  # noqa: PTH207 - it may lead into folders

    def path_of(self, filename: str) -> Path:
        """Path of a file, which may lie in a package."""
        package, _, rest = filename.removeprefix(PACKAGE).partition("/")
        if not filename.startswith(PACKAGE):
            return Path(filename)
        places, remark = self._packages.places(package, rest)
        if remark is not None:
            self._remarks.add(f"{package} {remark}", f"{self._path.name}: package {shown(package)}: {remark}")
        return places[0]


class _Handler:
    """Lets the copy of a node keep its place."""

    def handle(self, _operation: int, key: str, place: object, _source: object, copy: minidom.Node | None) -> None:
        """The copy was written where the node was."""
        if copy is not None:
            copy.setUserData(key, place, self)


class _Expansion:
    """One expansion, with the files that it reads."""

    def __init__(self, path: Path, settings: XacroSettings, remarks: Remarks) -> None:
        """Find xacro."""
        try:
            import xacro
            from xacro import substitution_args
        except ImportError:
            raise InputError(f"{path.name}: expected the package xacro to be installed: {INSTALL}") from None
        self._path, self._settings, self._remarks = path, settings, remarks
        self._xacro, self._substitution = xacro, substitution_args
        self._files = _Files(path, settings, remarks)
        self._declared: set[str] = set()
        self._paths: dict[str, Path] = {}  # of the files that were read, by the names that xacro has for them

    def run(self) -> tuple[Element, tuple[Path, ...]]:
        """The root element and the included files."""
        said = io.StringIO()
        with self._confined(), contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            try:
                document = self._xacro.process_file(
                    str(self._path), mappings=dict(self._settings.arguments), verbosity=0
                )
                root = _element(document.documentElement, self._path.name)
            except Exception as error:  # noqa: BLE001 - whatever an expression of the file can cause
                raise self._finding(error) from None
        for line in said.getvalue().splitlines():
            if line.startswith(WARNING):
                self._remarks.add(line, f"{self._path.name}: xacro: {line.removeprefix(WARNING)}")
        self._require_known_arguments()
        return root, tuple(file for file in self._files.known if file != self._path)

    @contextlib.contextmanager
    def _confined(self) -> Iterator[None]:
        """Lead everything that xacro reads or evaluates through this class, and afterwards as it was."""
        xacro, substitution = self._xacro, self._substitution
        loader = substitution.yaml.SafeLoader
        symbols = dict(substitution._eval_dict)
        symbols |= {"find": _find, "env": _no_environment, "optenv": self._default_of}
        namespace = xacro._global_symbols["python"]
        refused = {name: namespace[name] for name in REFUSED_SYMBOLS if name in namespace}
        changes: list[tuple[Any, str, Any]] = [
            (xacro, "parse", self._parse),
            (xacro, "abs_filename_spec", self._absolute),
            (xacro, "open", self._open),
            (xacro, "safe_eval", evaluated),
            (xacro, "glob", SimpleNamespace(glob=self._files.glob)),
            (substitution, "eval", evaluated),
            (substitution, "_eval_dict", symbols),
            (substitution, "_eval_find", _find),
            (substitution, "_eval_env", _no_environment),
            (substitution, "_eval_optenv", self._default_of),
            (loader, "yaml_constructors", dict(loader.yaml_constructors)),  # xacro adds units to them
        ]
        unknown = [name for owner, name, _ in changes if not hasattr(owner, name) and name not in BUILT_IN]
        if unknown:  # it could not be confined
            raise InputError(f"{self._path.name}: expected xacro 2.1, got one without {listed(unknown)}: {INSTALL}")
        with contextlib.ExitStack() as stack:
            for owner, name, value in changes:
                stack.callback(_restore, owner, name, vars(owner).get(name, _restore))
                setattr(owner, name, value)
            for name, value in refused.items():
                stack.callback(dict.__setitem__, namespace, name, value)
                dict.__delitem__(namespace, name)
            yield

    def _parse(self, _text: None, filename: str) -> minidom.Document:
        """DOM of a file, in which every element knows its line; stands in for the function of xacro."""
        if len(self._xacro.filestack) > MAX_DEPTH:
            raise InputError(f"expected at most {MAX_DEPTH} nested files, got one that includes itself, or more")
        try:
            path, data = self._files.read(filename)
            if path in map(self._paths.get, self._xacro.filestack[:-1]):
                raise InputError(f"expected no file that includes itself, got {shown(path.name)}")
            self._paths[filename] = path
        except FileNotFoundError as error:
            self._xacro.filestack.pop()
            raise self._xacro.XacroException(str(error), exc=FileNotFoundError("")) from None  # may be optional
        root = parse_xml(data, path.name)
        elements = list(root.walk(frozenset()))
        self._declared |= {element.attributes.get("name", "") for element in elements if element.tag == "xacro:arg"}
        self._declared |= {name.decode(errors="replace") for name in ARGUMENT.findall(data)}
        try:
            document: minidom.Document = minidom.parseString(data)  # noqa: S318 - there is no document type
        except expat.ExpatError as error:  # the prefix of a name
            reason = f"{expat.ErrorString(error.code)}; {NAMESPACE}"
            raise InputError(f"{path.name}:{error.lineno}: expected well-formed XML, got: {reason}") from None
        for node, element in zip(document.getElementsByTagName("*"), elements, strict=True):
            node.setUserData(PLACE, (element.file, element.line), _Handler())
            if element.tag == "xacro:arg" and element.attributes.get("name") in self._settings.arguments:
                node.setAttribute("default", element.attributes.get("default", ""))  # xacro demands one
        return document

    def _absolute(self, filename: str) -> str:
        """Path of a file as a macro names it; stands in for the function of xacro.

        It counts from the file that names it, but from the cell where it begins with the value of an argument; what
        does not lie there and lies beside the file is taken from there, with a remark.
        """
        if not filename.strip():
            empty = [name for name, value in self._settings.arguments.items() if not value.strip()]
            cure = f"state it as `xacro_args: {{{empty[0] if len(empty) == 1 else 'NAME'}: …}}`"
            raise InputError(f"expected the path of a file, got an empty one: {cure}, counted from the cell file")
        path = Path(self._xacro.filestack[-1] or ".").parent / filename
        values = [value for value in self._settings.arguments.values() if value]
        if not any(f"{filename}/".startswith(f"{value}/") for value in values) or Path(filename).is_absolute():
            return str(path)
        within = self._settings.within
        place = (Path() if within is None else within.folder).absolute() / filename
        if place.exists() or not self._files.path_of(str(path)).exists():
            return str(place)
        text = f"no {shown(filename)} beside the cell file: it was read from the folder {shown(path.parent.name)}"
        self._remarks.add(text, f"{self._path.name}: xacro_args: {text}")
        return str(path)

    def _open(self, filename: str) -> io.StringIO:
        """Text of a YAML file; stands in for the function of Python."""
        _, data = self._files.read(filename)
        return io.StringIO(data.decode("utf-8"))

    def _default_of(self, name: str, default: str = "") -> str:
        """Only the default of a variable of the environment counts: ``$(optenv NAME DEFAULT)``."""
        text = f"$(optenv {name}) is taken as {shown(default)}: variables of the environment are not read"
        self._remarks.add(text, f"{self._path.name}: {text}")
        return default

    def _require_known_arguments(self) -> None:
        """The cell gives no argument that none of the files declares."""
        for name in self._settings.arguments:
            if name not in self._declared | self._settings.elsewhere:
                known = sorted(self._declared)
                hint = did_you_mean(name, known) or f", expected one of: {listed(known)}"
                raise InputError(f"{self._path.name}: xacro_args: unknown argument {shown(name)}{hint}")

    def _finding(self, error: Exception) -> InputError:
        """What to say about a failure, with the place of the innermost element that it concerns."""
        chain = list(_chain(error))
        node = _innermost_node(error)
        file, line = (node and node.getUserData(PLACE)) or (self._path.name, 0)
        where = f"{file}:{line}" if line else file
        for call in chain:
            if isinstance(call, MemoryError):
                raise call
            if isinstance(call, RecursionError):
                what = "expected macros, includes and expressions that end, got some that call themselves"
                return InputError(f"{where}: {what}")
            if isinstance(call, InputError):
                is_located = str(call).startswith(tuple(f"{path.name}:" for path in self._files.known))
                return call if is_located else InputError(f"{where}: {call}")
            if isinstance(call, self._substitution.ArgException):
                return self._missing_argument(where, str(call))
        if node is not None and node.tagName == "xacro:arg" and not node.hasAttribute("default"):
            return self._missing_argument(where, node.getAttribute("name"))
        reason = " ".join(str(error).split())[:LONGEST_REASON] or type(error).__name__
        return InputError(f"{where}: expected a file that xacro can expand, got: {reason}")

    def _missing_argument(self, where: str, name: str) -> InputError:
        """An argument has no default, and the cell gives no value."""
        given = listed(self._settings.arguments)
        cure = f"state `xacro_args: {{{name}: …}}` of the robot in the cell"
        return InputError(f"{where}: expected a value for the argument {shown(name)}, got arguments: {given}: {cure}")


def _find(name: str) -> str:
    """Folder of a package, ``$(find NAME)``: a name only, which stands for the folder that has the file."""
    return PACKAGE + name


def _no_environment(name: str) -> str:
    """A variable of the environment is not part of the cell: ``$(env NAME)``."""
    raise InputError(f"expected no variable of the environment, got $(env {name}): use an argument, `xacro_args`")


def _restore(owner: Any, name: str, value: object) -> None:
    """Set an attribute as it was, or remove it."""
    if value is _restore:
        delattr(owner, name)
    else:
        setattr(owner, name, value)


def _element(node: minidom.Element, file: str, depth: int = 1) -> Element:
    """An expanded element with all below it."""
    place = node.getUserData(PLACE) or (file, 0)
    attributes = {name: PACKAGE_PATH.sub("package://", value) for name, value in node.attributes.items()}
    element = Element(node.tagName, attributes, *place)
    if depth > MAX_DEPTH:
        raise element.error(f"expected at most {MAX_DEPTH} nested elements")
    for child in node.childNodes:
        if isinstance(child, minidom.Element):
            element.children.append(_element(child, file, depth + 1))
    return element


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error and those that it was made from."""
    while error is not None:
        yield error
        exc = getattr(error, "exc", None)
        error = exc if isinstance(exc, BaseException) else error.__cause__ or error.__context__


def _innermost_node(error: BaseException) -> minidom.Element | None:
    """The element that was being expanded when an error was raised, if its place is known."""
    innermost = None
    for frame, _ in traceback.walk_tb(error.__traceback__):
        for name in ("node", "elt", "tag"):
            node = frame.f_locals.get(name)
            node = node.parentNode if isinstance(node, minidom.Text) else node
            if isinstance(node, minidom.Element) and node.getUserData(PLACE):
                innermost = node
    return innermost
