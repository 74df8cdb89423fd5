"""Clearance: what touches, when, and how near the bodies of a cell come to each other at the samples of a motion."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.measure import look, sharpen
from cellplan.collision.nearest import NOTHING, Nearest
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Check, ClearanceClass, ClearanceMinimum, ClearanceReport, Contact
from cellplan.model.task import Frame
from cellplan.scene.bodies import Kind
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.scene.survey import Survey, distance_curve, nearest, survey

STAGE: Final = "checking clearance"
CHUNK_WORK: Final = 2_000_000  # [-] pairs times samples worked on at once: 16 MB of bounds
CHUNK_SAMPLES: Final = 2048  # [-] samples worked on at once: 20 MB of poses for forty bodies
CURVE_POINTS: Final = 200  # [-] instants of the plotted curves, beside those of the minima
SAME_CONTACT: Final = 0.010  # [s] touches with shorter breaks between them are one contact
AT_SURFACE: Final = 1e-4  # [m] a tool at work nearer to the part than this counts as touching it
MM: Final = 1e3

Samples = NDArray[np.intp]
Spans = list[tuple[int, int]]  # first and last sample of each contact


@dataclass(slots=True)
class _Findings:
    """What has been seen so far, by index into ``Scene.pairs``."""

    touched: dict[int, list[Samples]] = field(default_factory=dict)
    in_the_way: dict[int, list[Samples]] = field(default_factory=dict)
    nearest: dict[ClearanceClass, Nearest] = field(default_factory=dict)


def check_clearance(
    scene: Scene, schedule: Schedule, q: Array, *, progress: Progress = silent
) -> tuple[ClearanceReport, tuple[Check, ...]]:
    """Find every contact and the smallest distance of each class at the samples of a motion.

    The tool of a robot whose task is scheduled may touch the part within ``checks.contact_zone`` of its tip, from the
    first instant to the last: before its start and after its end it dwells on the part. Such contacts are listed as
    allowed, and the distance between that tool and the part is no matter of clearance. What of the tool lies outside
    the zone must not touch. A robot whose task is not scheduled stands idle where its task starts, at the part; it is
    to be withdrawn before the program is run, so what it has in the way of the part is listed but fails no check.

    Args:
        scene: The cell made computable.
        schedule: The tasks and the clock.
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        progress: Who wants to know how far it is.

    Returns:
        The distances, never above the truth and within 0.1 mm of it, and a verdict on each class.
    """
    idle = _idle_exclusions(scene, schedule)
    rows = [row for row in range(len(scene.pairs)) if row not in idle]
    findings = _Findings()
    for first, last in _chunks(len(q), len(rows)):
        found = survey(scene, range(len(scene.pairs)), scene.body_poses(q[first:last]))
        _note_contacts(findings, found, first, idle=idle)
        for kind, own in _by_class(scene, rows, Rule.CLEARANCE).items():
            _note_nearest(findings, found, kind, own=own, first=first)
        progress(STAGE, 0.8 * last / len(q))
    contacts = (
        *_contacts(scene, schedule.times, findings.touched, idle={}),
        *_allowed(scene, schedule, q, rows=rows),
        *_contacts(scene, schedule.times, findings.in_the_way, idle=idle),
    )
    minima = {kind: _minimum(scene, schedule.times, findings, kind) for kind in ClearanceClass}
    curve_samples, curves = _curves(scene, q, findings, rows=rows)
    progress(STAGE, 1.0)
    report = ClearanceReport(
        minima=minima,
        contacts=contacts,
        exclusions=(*scene.exclusions, *_stated(scene, rows), *((*scene.names(scene.pairs[r]), idle[r]) for r in idle)),
        pair_count=len(rows),
        curve_times=schedule.times[curve_samples],
        curves=curves,
    )
    classes = [kind for kind in ClearanceClass if any(scene.pairs[row].clearance_class is kind for row in rows)]
    checks = [check for kind in classes for check in _collision_checks(contacts, kind)]
    checks += [_clearance_check(scene.cell, kind, minima[kind]) for kind in classes if minima[kind].minimum is not None]
    return report, tuple(checks)


def _idle_exclusions(scene: Scene, schedule: Schedule) -> dict[int, str]:
    """Pairs of the part with robots whose task is not worked on now, and what is said of them."""
    at_work = {scheduled.task.robot for scheduled in schedule.tasks}
    idle = {task.robot for task in scene.cell.tasks if task.relative_to is Frame.PART} - at_work
    left_out = {}
    for row, pair in enumerate(scene.pairs):
        ends = [scene.bodies[pair.first], scene.bodies[pair.second]]
        robots = {body.robot for body in ends if body.kind in (Kind.LINK, Kind.TOOL)} & idle
        if robots and any(body.kind is Kind.PART for body in ends):
            left_out[row] = f"{robots.pop()} stands idle in this run: withdraw it from the part before running it"
    return left_out


def _chunks(samples: int, pairs: int) -> Iterator[tuple[int, int]]:
    """Stretches of samples small enough to be worked on at once."""
    step = int(np.clip(CHUNK_WORK // max(1, pairs), 64, CHUNK_SAMPLES))
    for first in range(0, samples, step):
        yield first, min(samples, first + step)


def _by_class(scene: Scene, rows: Sequence[int], rule: Rule) -> dict[ClearanceClass, list[int]]:
    """Pairs of one rule, by class."""
    chosen: dict[ClearanceClass, list[int]] = {}
    for row in rows:
        if scene.pairs[row].rule is rule:
            chosen.setdefault(scene.pairs[row].clearance_class, []).append(row)
    return chosen


def _note_contacts(findings: _Findings, found: Survey, first: int, *, idle: Mapping[int, str]) -> None:
    """Write down at which samples which pairs touch; idle robots at the part on a page of their own."""
    for place in np.flatnonzero(found.touching.any(axis=1)):
        samples, row = first + np.flatnonzero(found.touching[place]), found.rows[place]
        (findings.in_the_way if row in idle else findings.touched).setdefault(row, []).append(samples)


def _note_nearest(findings: _Findings, found: Survey, kind: ClearanceClass, *, own: Sequence[int], first: int) -> None:
    """Write down the nearest pair of a class, unless one of the class touches: then nothing can be nearer."""
    if any(found.scene.pairs[row].clearance_class is kind for row in findings.touched):
        return
    known = findings.nearest.get(kind, NOTHING)
    new = nearest(found, own, best=known.measured)
    proved = min(known.proved, new.proved)
    if new.row < 0:
        findings.nearest[kind] = Nearest(proved, known.measured, known.row, known.sample)
    else:
        findings.nearest[kind] = Nearest(proved, new.measured, new.row, first + new.sample)


def _contacts(
    scene: Scene, times: Array, touched: Mapping[int, list[Samples]], *, idle: Mapping[int, str]
) -> list[Contact]:
    """Contacts by pair and then by time: forbidden ones, or those of idle robots that are to be withdrawn."""
    contacts = []
    for row in sorted(touched):
        pair = scene.pairs[row]
        reason = "outside the contact zone of the tool at work" if pair.rule is Rule.PROCESS else ""
        contacts += [
            Contact(
                pair=scene.names(pair),
                clearance_class=pair.clearance_class,
                first_s=float(times[first]),
                last_s=float(times[last]),
                is_allowed=row in idle,
                reason=idle.get(row, reason),
            )
            for first, last in _spans(np.concatenate(touched[row]), times)
        ]
    return contacts


def _spans(samples: Samples, times: Array) -> Spans:
    """First and last sample of each contact, short breaks bridged."""
    ends = np.flatnonzero(np.diff(times[samples]) > max(SAME_CONTACT, 1.5 * float(times[-1]) / max(1, len(times) - 1)))
    first, last = np.append(0, ends + 1), np.append(ends, len(samples) - 1)
    return [(int(samples[a]), int(samples[b])) for a, b in zip(first, last, strict=True)]


def _allowed(scene: Scene, schedule: Schedule, q: Array, *, rows: Sequence[int]) -> list[Contact]:
    """Contacts of tools at work with the part: from the first touch to the last, whatever short breaks there are."""
    chosen = [row for row in rows if scene.pairs[row].rule is Rule.PROCESS]
    spans: dict[int, tuple[int, int]] = {}
    for first, last in _chunks(len(q), 1) if chosen else ():
        poses = scene.body_poses(q[first:last])
        for row in chosen:
            span = _touch_span(scene, row, poses)
            if span:
                spans[row] = (spans.get(row, (first + span[0], 0))[0], first + span[1])
    return [
        Contact(
            pair=scene.names(scene.pairs[row]),
            clearance_class=scene.pairs[row].clearance_class,
            first_s=float(schedule.times[first]),
            last_s=float(schedule.times[last]),
            is_allowed=True,
            reason=f"at work, within {MM * scene.cell.checks.contact_zone:g} mm of the tool tip",
        )
        for row, (first, last) in sorted(spans.items())
    ]


def _touch_span(scene: Scene, row: int, poses: BodyPoses) -> tuple[int, int] | None:
    """First and last sample at which a tool is at the surface of the part, found from both ends."""
    samples = range(poses.p.shape[1])
    first = next((k for k in samples if _is_at_surface(scene, row, poses, sample=k)), None)
    if first is None:
        return None
    return first, next(k for k in reversed(samples) if _is_at_surface(scene, row, poses, sample=k))


def _is_at_surface(scene: Scene, row: int, poses: BodyPoses, *, sample: int) -> bool:
    """Whether a tool touches the part, or very nearly so: tracking errors of a micrometre decide nothing here."""
    pair = (scene.pairs[row].first, scene.pairs[row].second)
    reading = look(scene.engine, pair, poses, sample=sample)
    if reading.touches or reading.bound > AT_SURFACE:
        return reading.touches
    if not all(scene.engine.bodies[index].is_convex for index in pair):
        return False
    return sharpen(scene.engine, pair, poses, sample=sample, reading=reading).bound <= AT_SURFACE


def _minimum(scene: Scene, times: Array, findings: _Findings, kind: ClearanceClass) -> ClearanceMinimum:
    """Smallest distance of a class: zero where one of its pairs touches."""
    touched = [(int(found[0][0]), row) for row, found in findings.touched.items()]
    first = min((entry for entry in touched if scene.pairs[entry[1]].clearance_class is kind), default=None)
    if first is not None:
        sample, row = first
        return ClearanceMinimum(
            minimum=0.0, pair=scene.names(scene.pairs[row]), at_s=float(times[sample]), certified=False
        )
    found = findings.nearest.get(kind, NOTHING)
    if found.row < 0:
        return ClearanceMinimum(minimum=None, pair=None, at_s=None, certified=False)
    return ClearanceMinimum(
        minimum=max(0.0, min(found.proved, found.measured)),
        pair=scene.names(scene.pairs[found.row]),
        at_s=float(times[found.sample]),
        certified=False,
    )


def _curves(
    scene: Scene, q: Array, findings: _Findings, *, rows: Sequence[int]
) -> tuple[Array, Mapping[ClearanceClass, Array]]:
    """Samples of the plotted curves and the smallest distance of each class there."""
    samples = set(np.linspace(0, len(q) - 1, CURVE_POINTS).round().astype(int).tolist())
    samples |= {found.sample for found in findings.nearest.values() if found.row >= 0}
    samples |= {int(found[0][0]) for found in findings.touched.values()}
    chosen = np.array(sorted(samples))
    poses = scene.body_poses(q[chosen])
    touched = {row: np.isin(chosen, np.concatenate(found)) for row, found in findings.touched.items()}
    curves = {}
    for kind, own in _by_class(scene, rows, Rule.CLEARANCE).items():
        touching = np.array([touched.get(row, np.zeros(len(chosen), dtype=bool)) for row in own])
        curve = distance_curve(scene, own, poses, touching=touching)
        for row, flags in touched.items():
            if scene.pairs[row].clearance_class is kind:
                curve[flags] = 0.0
        curves[kind] = curve
    return chosen, curves


def _stated(scene: Scene, rows: Sequence[int]) -> list[tuple[str, str, str]]:
    """Pairs of which less is asked than the full clearance, with the reason."""
    return [
        (*scene.names(scene.pairs[row]), scene.pairs[row].reason)
        for row in rows
        if scene.pairs[row].rule is not Rule.CLEARANCE
    ]


def _collision_checks(contacts: Sequence[Contact], kind: ClearanceClass) -> list[Check]:
    """One failed check for each pair of a class that touches, or one passed check for the class."""
    own: dict[tuple[str, str], list[Contact]] = {}
    for contact in contacts:
        if contact.clearance_class is kind and not contact.is_allowed:
            own.setdefault(contact.pair, []).append(contact)
    if not own:
        message = f"collision: none in class {kind} at the samples"
        return [_collision(str(kind), passed=True, seconds=0.0, at_s=None, message=message)]
    return [_pair_collision(pair, found) for pair, found in own.items()]


def _pair_collision(pair: tuple[str, str], contacts: Sequence[Contact]) -> Check:
    """The failed check of one pair."""
    first = contacts[0]
    when = f"from {first.first_s:.3f} s to {first.last_s:.3f} s"
    if first.first_s == first.last_s:
        when = f"at {first.first_s:.3f} s"
    more = f" and {len(contacts) - 1} more times" if len(contacts) > 1 else ""
    where = f" {first.reason}" if first.reason else ""
    return _collision(
        f"{pair[0]} - {pair[1]}",
        passed=False,
        seconds=sum(contact.last_s - contact.first_s for contact in contacts),
        at_s=first.first_s,
        message=f"collision: {pair[0]} touches {pair[1]}{where} {when}{more}",
    )


def _collision(subject: str, *, passed: bool, seconds: float, at_s: float | None, message: str) -> Check:
    """A check on contact; its value is the time spent in contact."""
    return Check(
        name="collision", subject=subject, passed=passed, value=seconds, limit=0.0, unit="s", at_s=at_s, message=message
    )


def _clearance_check(cell: Cell, kind: ClearanceClass, found: ClearanceMinimum) -> Check:
    """Whether the smallest distance of a class is what the cell demands."""
    pair, at_s = found.pair or ("", ""), found.at_s or 0.0
    minimum, limit = MM * float(found.minimum or 0.0), MM * cell.checks.clearance
    shown = np.floor(10.0 * minimum) / 10.0  # rounded down: never more than there is
    return Check(
        name="clearance",
        subject=str(kind),
        passed=bool(found.minimum is not None and found.minimum >= cell.checks.clearance),
        value=minimum,
        limit=limit,
        unit="mm",
        at_s=at_s,
        message=f"clearance {kind}: {pair[0]} to {pair[1]} {shown:.1f} mm at {at_s:.3f} s, required {limit:.1f} mm",
    )
