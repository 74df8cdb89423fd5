"""Toolpath tables: tool positions on the part, with axes or quaternions, from a CSV file."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.files import read_regular_file, utf8_text
from cellplan.files.input.findings import Finding, did_you_mean, kind_of, listed, raise_findings, shown
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.transforms import quaternion_to_rotation
from cellplan.model.task.task import SampledPath, TimedPath

TIME: Final = "t_s"
POSITION: Final = ("x_mm", "y_mm", "z_mm")
AXIS: Final = ("i", "j", "k")
QUATERNION: Final = ("qw", "qx", "qy", "qz")
COLUMNS: Final = (TIME, *POSITION, *AXIS, *QUATERNION)

MOST_BYTES: Final = 50_000_000
MOST_POINTS: Final = 200_000
FINDING_LIMIT: Final = 20  # different findings that are reported
UNIT_TOL: Final = 1e-3  # [-] room for quaternions written with four digits
SHORTEST_AXIS: Final = 1e-6  # [-] a shorter vector has no direction
LONGEST_AXIS: Final = 1e6  # [-] of a component of a direction, as in a cell file
FARTHEST: Final = 100_000.0  # [mm] no part is that large: a wrong unit
SHORTEST_S: Final = 1e-6  # [s] between two times, halved for rounding; no controller resolves less
LATEST: Final = 1e6  # [s] eleven days: a wrong unit
CLOSING_TOL: Final = 1e-3  # [mm] room for a return to the start written with three decimals
FEWEST_CLOSED: Final = 4  # rows of a trajectory that encloses something and repeats its start
METRES_PER_MM: Final = 1e-3

_LIMITS: Final = (
    {TIME: (LATEST, " s")} | dict.fromkeys(POSITION, (FARTHEST, " mm")) | dict.fromkeys(AXIS, (LONGEST_AXIS, ""))
)
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_CONTROL: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\x85\u2028\u2029]|\r(?!\n)")
_TIME_WORDS: Final = ("t", "time", "time_s", "t_ms", "time_ms", "t[s]", "t [s]", "s", "seconds")
_LENGTH_UNITS: Final = ("", "_m", "_cm", "_in", "_inch", "_um", "[mm]", " mm", " [mm]", "(mm)", " (mm)")


@dataclass(slots=True)
class _Findings:
    """Findings gathered while reading."""

    entries: list[Finding] = field(default_factory=list)
    kinds: set[tuple[str, ...]] = field(default_factory=set)

    def add(self, line: int, text: str, *, column: str = "") -> None:
        """Note a finding about a line, or about one value of it."""
        finding = Finding(line=line, key=f"column '{column}'" if column else "", text=text)
        self.entries.append(finding)
        self.kinds.add(kind_of(finding))

    @property
    def is_enough(self) -> bool:
        """Whether reading on would not help."""
        return len(self.kinds) >= FINDING_LIMIT


def read_toolpath_csv(
    path: Path, *, is_smooth: bool, is_closed: bool, source: str | None = None, join: float = 0.0
) -> SampledPath | TimedPath:
    """Read tool targets: ``x_mm, y_mm, z_mm`` and, where the file has them, ``i, j, k`` or ``qw, qx, qy, qz``.

    The header names the columns, in any order. Axes point into the part; quaternions turn the tool's axes into the
    part frame. Axes of any length and quaternions of nearly one are brought to length one. A column ``t_s`` makes the
    path a trajectory.

    Args:
        is_smooth: Whether a smooth curve joins the points instead of straight sides; a trajectory is smooth.
        is_closed: Whether the last point is joined to the first; a closed trajectory repeats its start at its end.
        source: Name of the file for messages; by default its last part.
        join: Distance in [m]: points nearer to the point before than this are left out; 0 for none.

    Raises:
        InvalidFileError: All that is wrong with the content, with line and column.
        InputError: The file cannot be read at all.
    """
    name = source or path.name
    text = _read_text(path, name)
    findings = _Findings()
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").rstrip("\n \t").split("\n")
    columns = _read_header(lines[0], findings)
    raise_findings(name, findings.entries)
    if len(lines) - 1 > MOST_POINTS:
        raise InputError(f"{name}: expected at most {MOST_POINTS} points, got {len(lines) - 1}")
    values = _read_rows(lines, columns, findings)
    raise_findings(name, findings.entries)
    if len(values) < 2:
        raise InputError(f"{name}: expected at least 2 points below the header, got {len(values)}")
    axes = _units(values, columns, findings, desired=AXIS, what="tool axis")
    quaternions = _units(values, columns, findings, desired=QUATERNION, what="quaternion")
    times = values[:, columns.index(TIME)] if TIME in columns else None
    if times is not None:
        _examine_times(times, findings)
        if is_closed:
            _close(values, columns, (axes, quaternions), findings)
    raise_findings(name, findings.entries)
    points = values[:, [columns.index(column) for column in POSITION]] * METRES_PER_MM
    rotations = None if quaternions is None else quaternion_to_rotation(quaternions)
    if times is None:
        is_apart = _apart(points, join, is_closed=is_closed)
        return SampledPath(
            source=name,
            points=points[is_apart],
            axes=None if axes is None else axes[is_apart],
            rotations=None if rotations is None else rotations[is_apart],
            is_smooth=is_smooth,
            is_closed=is_closed,
            join=join,
            lines=tuple((np.flatnonzero(is_apart) + 2).tolist()),
        )
    return TimedPath(source=name, times=times, points=points, axes=axes, rotations=rotations, is_closed=is_closed)


def _read_text(path: Path, name: str) -> str:
    """Content of a regular file of sensible size, as text without control characters."""
    text = utf8_text(read_regular_file(path, file=name, limit=MOST_BYTES), file=name)
    match = _CONTROL.search(text)
    if match:
        line = text.count("\n", 0, match.start()) + 1
        raise InputError(f"{name}:{line}: expected plain text, got control character {ord(match.group()[0]):#04x}")
    return text


def _read_header(line: str, findings: _Findings) -> list[str]:
    """Column names of the first line, complete and each known once."""
    if ";" in line or "\t" in line:
        sign = "';'" if ";" in line else "tabs"
        findings.add(1, f"expected columns separated by ',', got {sign}; export with ',' and a decimal point")
        return []
    columns = [_unquoted(cell) for cell in line.split(",")]
    for column in columns:
        if column not in COLUMNS:
            findings.add(1, _unknown(column))
    for column in dict.fromkeys(column for column in columns if column in COLUMNS and columns.count(column) > 1):
        findings.add(1, f"expected column '{column}' once, got it {columns.count(column)} times")
    if findings.entries:
        return columns
    for group, is_needed in ((POSITION, True), (AXIS, False), (QUATERNION, False)):
        missing = [column for column in group if column not in columns]
        if missing and (is_needed or len(missing) < len(group)):
            findings.add(1, f"expected columns {listed(group)}, but {listed(missing)} is missing")
    if set(AXIS) & set(columns) and set(QUATERNION) & set(columns):
        findings.add(1, f"expected axes ({listed(AXIS)}) or quaternions ({listed(QUATERNION)}), got both")
    return columns


def _unknown(column: str) -> str:
    """Say that a column is not known, and what its writer may have meant."""
    text = f"unknown column {shown(column)}"
    for axis in "xyz":
        if column.lower() in {axis + unit for unit in _LENGTH_UNITS} | {f"{axis}_mm"}:
            return f"{text}, lengths are in mm: write {axis}_mm"
    if column.lower() in _TIME_WORDS:
        return f"{text}, times are in s: write {TIME}"
    if _NUMBER.fullmatch(column):
        return f"{text}, the first line names the columns: {listed(POSITION)}"
    return f"{text}{did_you_mean(column, COLUMNS) or f', allowed are {listed(COLUMNS)}'}"


def _unquoted(cell: str) -> str:
    """A value without blanks and without a pair of quotes round it."""
    cell = cell.strip()
    return cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell


def _read_rows(lines: list[str], columns: list[str], findings: _Findings) -> Array:
    """Numbers below the header, shape (N, columns); rows with findings are left out."""
    rows: list[list[float]] = []
    for line, text in enumerate(lines[1:], start=2):
        if findings.is_enough:
            findings.add(line, f"and so on: stopped reading after {FINDING_LIMIT} findings")
            break
        row = list(_read_row(line, text, columns, findings))
        if len(row) == len(columns):
            rows.append(row)
    return np.array(rows, dtype=float).reshape(-1, len(columns))


def _read_row(line: int, text: str, columns: list[str], findings: _Findings) -> Iterator[float]:
    """Numbers of one row; an invalid value is reported and left out."""
    if not text.strip():
        findings.add(line, "expected a row of numbers, got a blank line; leave it out")
        return
    cells = text.split(",")
    if text.count('"') % 2:
        findings.add(line, "expected closed quotes, got an odd number of '\"'")
        return
    if len(cells) != len(columns):
        hint = "; separate values with ',' and write decimals with '.'" if len(cells) > len(columns) else ""
        findings.add(line, f"expected {len(columns)} values, got {len(cells)}{hint}")
        return
    for cell, column in zip(cells, columns, strict=True):
        word = _unquoted(cell)
        if not _NUMBER.fullmatch(word):
            findings.add(line, f"expected {_desired(word)}, got {shown(word)}", column=column)
            continue
        value = float(word)
        limit, unit = _LIMITS.get(column, (1.0 + UNIT_TOL, ""))
        if abs(value) > limit:
            findings.add(line, f"expected at most {limit:.10g}{unit} either way, got {word}", column=column)
            continue
        yield value


def _desired(word: str) -> str:
    """What a word that is not a number should have been."""
    if re.fullmatch(r"[+-]?(nan|inf|infinity)", word, re.IGNORECASE):
        return "a finite number"
    return "a number with a decimal point" if re.fullmatch(r"[+-]?\d+,\d+", word) else "a number"


def _units(
    values: Array, columns: list[str], findings: _Findings, *, desired: tuple[str, ...], what: str
) -> Array | None:
    """Columns that hold vectors of length one, brought to it; None when the file has none."""
    if desired[0] not in columns:
        return None
    vectors = values[:, [columns.index(column) for column in desired]]
    norms = np.linalg.norm(vectors, axis=1)
    length = "length 1" if desired == QUATERNION else "a length"
    is_bad = ~(np.abs(norms - 1.0) <= UNIT_TOL) if desired == QUATERNION else ~(norms >= SHORTEST_AXIS)
    for row in np.flatnonzero(is_bad):
        findings.add(int(row) + 2, f"expected a {what} ({listed(desired)}) of {length}, got {norms[row]:.6g}")
    return vectors / np.where(norms > 0.0, norms, 1.0)[:, None]


def _apart(points: Array, least: float, *, is_closed: bool) -> Flags:
    """Which points are at least a distance from the last one taken, of a closed path also from the first one."""
    is_apart = np.ones(len(points), dtype=bool)
    last = 0
    for k in range(1, len(points) if least > 0.0 else 0):
        is_apart[k] = np.linalg.norm(points[k] - points[last]) >= least
        last = k if is_apart[k] else last
    while is_closed and last > 0 and np.linalg.norm(points[last] - points[0]) < least:
        is_apart[last] = False
        last = int(np.flatnonzero(is_apart)[-1])
    return is_apart


def _examine_times(times: Array, findings: _Findings) -> None:
    """Require times that start at zero and increase from row to row."""
    if times[0] != 0.0:
        text = f"expected 0 in the first row, got {times[0]:.9g}; a task is shifted by its start_s"
        findings.add(2, text, column=TIME)
    for row in np.flatnonzero(~(np.diff(times) > 0.5 * SHORTEST_S))[:FINDING_LIMIT]:
        text = f"expected a time after {times[row]:.9g} of the row before, got {times[row + 1]:.9g}"
        findings.add(int(row) + 3, text, column=TIME)


def _close(
    values: Array, columns: list[str], directions: tuple[Array | None, Array | None], findings: _Findings
) -> None:
    """Make the last row of a closed trajectory equal to the first, which it must repeat within rounding."""
    last = len(values) + 1
    if len(values) < FEWEST_CLOSED:
        findings.add(last, f"expected at least {FEWEST_CLOSED} rows for a closed trajectory, got {len(values)}")
        return
    place = [columns.index(column) for column in POSITION]
    gap = np.abs(values[-1, place] - values[0, place]).max()
    if gap > CLOSING_TOL:
        text = f"expected a closed trajectory to end at the point of its first row, but it ends {gap:.6g} mm from it"
        findings.add(last, f"{text}; repeat the first row at the end of the cycle")
    values[-1, place] = values[0, place]
    for vectors in directions:
        if vectors is not None:
            sign = -1.0 if vectors.shape[1] == len(QUATERNION) and vectors[-1] @ vectors[0] < 0.0 else 1.0
            if np.linalg.norm(sign * vectors[-1] - vectors[0]) > UNIT_TOL:
                findings.add(last, "expected a closed trajectory to end with the orientation of its first row")
            vectors[-1] = vectors[0]
