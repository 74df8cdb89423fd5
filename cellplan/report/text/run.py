"""A run as text: verdict, failed checks, worst figures in columns, what was not judged, location of the report."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from cellplan.model.report.check_kinds import CHECK_KINDS
from cellplan.model.report.greatest_feed import cure_of
from cellplan.model.report.left_out import NOTHING_LEFT_OUT, TITLES, LeftOutKind
from cellplan.model.solver import METHODS
from cellplan.report.record.common import Record
from cellplan.report.record.numbers import fixed, floored, percent, plain, seconds, small
from cellplan.report.record.phases import instant_text
from cellplan.report.record.sections.clearance import other_classes
from cellplan.report.text.columns import Row, aligned
from cellplan.report.text.forces import force_rows
from cellplan.report.text.method import DEFAULT_METHOD, moved_start_lines, no_accurate_mode
from cellplan.report.text.notes import accuracy_note, clock_note, grip_notes, open_surface_notes, skew_row

GAINED: Final = 0.95  # [-] of the roughness of a file: a smoothed path with more gains nothing
NEAR_GREATEST: Final = 1.02  # [-] times a feed: a greatest one below is said
MOST_OF_A_GROUP: Final = 8  # [-] failed checks that are shown; further ones are counted


def read_record(folder: Path) -> Record:
    """The report of a run on disk."""
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def summary_lines(record: Record, folder: Path) -> list[str]:
    """All lines about one run folder."""
    return [*verdict_lines(record), *_place_lines(folder)]


def verdict_lines(record: Record) -> list[str]:
    """What the checks say of a run: verdict, failed checks, worst figures, what was not judged."""
    return [
        f"{record['cell']}: {record['status']}",
        f"  {count_text(record['checks'])}; {motion_text(record)}",
        *failure_lines(record["checks"], "the report"),
        *figure_lines(record, "the report"),
        *(f"  {line}" for line in record.get("not_in_program", [])),
    ]


def figure_lines(record: Record, more: str) -> list[str]:
    """The worst values of a run, and what was not judged: the pairs stand at ``more``."""
    return [
        *_program_lines(record),
        *aligned(_rows(record)),
        *_integration_lines(record["solver"]),
        *_tilt_lines(record),
        *(f"  {line}" for line in moved_start_lines(record["solver"].get("moved_starts") or [])),
        *(f"  note: {line}" for line in record.get("remarks", [])),
        *(f"  note: {line}" for _, line in open_surface_notes(record.get("open_surfaces", []))),
        *(f"  grip: {line}" for line in grip_notes(record)),
        *not_judged_lines(record),
        *(f"  {line}" for line in record.get("rests_on", {}).get("lines", [])),
        *left_out_lines(record, more),
    ]


def left_out_lines(record: Record, more: str) -> list[str]:
    """How many pairs were not judged in full, by reason; nothing for a record without such a key."""
    if "left_out" not in record:
        return []
    counts = Counter(str(entry["kind"]) for entry in record["left_out"])
    if not counts:
        return [f"  {NOTHING_LEFT_OUT}"]
    kinds = ", ".join(f"{counts[kind]} {TITLES[kind]}" for kind in LeftOutKind if counts[kind])
    total = counts.total()
    return [f"  not checked in full: {total} {'pair' if total == 1 else 'pairs'} ({kinds}); all in {more}"]


def motion_text(record: Record) -> str:
    """Mode, duration and method."""
    cycle = seconds(record["cycle_time_s"])
    return f"mode {record['mode']}, {cycle} s{_clock_text(record)}{_method_text(record['solver'])}"


def _rows(record: Record) -> Iterator[Row]:
    """The worst values: distances, margins and speeds first, errors of the tools after them."""
    yield from _clearance_rows(record["clearance"])
    yield from _margin_rows(record["joints"])
    yield from _speed_rows(record["joints"])
    yield from acceleration_rows(record)
    yield from _torque_rows(record.get("torques", {}))
    yield from _task_rows(record["tasks"])
    yield from smoothing_rows(record["tasks"])
    yield from run_rows(record["tasks"])
    yield from feed_rows({name: task.get("greatest_feed") for name, task in record["tasks"].items()})
    yield from _closure_rows(record.get("closure", {}))
    yield from skew_row(record)
    yield from stop_rows(record)
    yield from force_rows(record.get("forces"))
    yield from _drift_rows(record.get("repeatability", {}))
    yield from _slack_rows(record["solver"]["slack"])


def _clock_text(record: Record) -> str:
    """What determines the duration, unless the cell file states it."""
    note = clock_note(record)
    return f" ({note})" if note else ""


def _method_text(solver: Record) -> str:
    """The method, unless it is the default one."""
    return "" if solver["method"] == DEFAULT_METHOD else f", method {solver['method']}"


def _task_rows(tasks: Record) -> Iterator[Row]:
    for name, task in tasks.items():
        phase = f", {task['phase']}" if task.get("phase") else ""
        yield "largest tool error", _error_text(task), f"task {name} ({task['robot']}){phase}"
    for name, task in tasks.items():
        if task.get("path_bulge_mm"):
            yield (
                "largest bulge of a path",
                f"{task['path_bulge_mm']:.3g} mm",
                f"from the sides between its points, task {name}",
            )


def smoothing_rows(tasks: Record) -> Iterator[Row]:
    """How smooth paths became, with the bound, and the errors against their files."""
    for name, task in tasks.items():
        if (smoothing := task.get("smoothing")) is None:
            continue
        for what in ("points", "axes"):
            if (roughness := smoothing[what]) is not None and roughness["given"]:
                smoothed, bound = (roughness[key] / roughness["given"] for key in ("smoothed", "bound"))
                figure = f"{percent(smoothed, 1)} of the file's"
                gain = "; the tube gains nothing" if smoothed > GAINED else ""
                yield f"roughness of {what}", figure, f"at least {floored(100.0 * bound)} %, task {name}{gain}"
        position, orientation = smoothing["max_position_error_mm"], smoothing["max_orientation_error_deg"]
        figure = f"{_short(position)} mm, {_short(orientation)} deg"
        yield "error against the file", figure, f"{small(smoothing['max_depth_mm'])} mm into the part, task {name}"


def run_rows(tasks: Record) -> Iterator[Row]:
    """How long the tool runs in and out, and where it comes to its feed, or to rest, on the work."""
    for name, task in tasks.items():
        if "run_in_mm" in task:
            run_in, run_out = task["run_in_mm"], task["run_out_mm"]
            on_work = "" if run_in and run_out else f"; the tool {'slows down' if run_in else 'speeds up'} on the work"
            yield "run-in and run-out", f"{small(run_in)} mm and {small(run_out)} mm", f"task {name}{on_work}"


def feed_rows(feeds: Record) -> Iterator[Row]:
    """What binds the feeds that are near the greatest ones, or beyond, by task."""
    for name, feed in feeds.items():
        if feed and feed["greatest_mm_s"] is not None and feed["greatest_mm_s"] < NEAR_GREATEST * feed["feed_mm_s"]:
            ramp, point = " in a ramp" if feed["in_ramp"] else "", f" ({feed['point']})" if feed["point"] else ""
            binds = [word for word in (feed["binding"], feed["limit"]) if word != name]
            where = f"{', '.join(binds)}{ramp}, at {small(feed['at_mm'])} mm{point} {instant_text(feed)}"
            figure = f"{fixed(feed['greatest_mm_s'])} mm/s"
            yield "greatest feed", figure, f"task {name} at {fixed(feed['feed_mm_s'])}: {where}{cure_of(feed['limit'])}"


def _closure_rows(closures: Record) -> Iterator[Row]:
    for robot, closure in closures.items():
        yield "largest closure error", _error_text(closure), f"grasp of {robot} {instant_text(closure)}"


def _error_text(errors: Record) -> str:
    """The largest error of position and of orientation."""
    position, orientation = _largest(errors, "position_error", "mm"), _largest(errors, "orientation_error", "deg")
    return f"{_short(position)} mm, {_short(orientation)} deg"


def _largest(errors: Record, name: str, unit: str) -> float | None:
    """The larger of an error at the rows and between them."""
    at_rows: float | None = errors[f"max_{name}_{unit}"]
    between: float | None = errors.get(f"max_{name}_between_rows_{unit}")
    return at_rows if at_rows is None or between is None else max(at_rows, between)


def _margin_rows(joints: Record) -> Iterator[Row]:
    """The joint with the smallest margin, in degrees and in millimetres."""
    for unit in ("deg", "mm"):
        bounded = [
            (use["margin"], f"{robot} {joint} {instant_text(use, 'margin_at_s')}")
            for robot, uses in joints.items()
            for joint, use in uses.items()
            if use["unit"] == unit and use["margin"] is not None
        ]
        if bounded:
            margin, where = min(bounded)
            yield "smallest joint margin", f"{plain(floored(margin))} {unit}", where


def _speed_rows(joints: Record) -> Iterator[Row]:
    driven = [
        (use["velocity_ratio"], f"{robot} {joint} {instant_text(use, 'peak_velocity_at_s')}")
        for robot, uses in joints.items()
        for joint, use in uses.items()
        if use["velocity_ratio"] is not None
    ]
    if driven:
        ratio, where = max(driven)
        yield "largest joint speed", f"{percent(ratio, 1)} of its limit", where


def _torque_rows(torques: Record) -> Iterator[Row]:
    """The drive with the largest share of its torque, and the work of all that is known."""
    driven = [
        (use["torque_ratio"], use["unit"], f"{robot} {joint} {instant_text(use, 'peak_torque_at_s')}")
        for robot, record in torques.items()
        for joint, use in record["joints"].items()
        if use["torque_ratio"] is not None
    ]
    if driven:
        ratio, unit, where = max(driven)
        kind = "torque" if unit == "Nm" else "force"
        yield f"largest joint {kind}", f"{percent(ratio, 1)} of its limit", where
    if torques:
        energy = sum(record["energy_j"] for record in torques.values())
        yield "work of the drives", f"{fixed(energy, 0)} J", f"of {', '.join(torques)}"


def _program_lines(record: Record) -> Iterator[str]:
    """The phases of a program from home to home, and how its transfer moves were found."""
    if not record.get("cycles"):
        return
    runs, transfers = record["runs"], record["solver"]["transfers"] or {}
    phases = ", ".join(f"{name} {seconds(run['cycle_time_s'])} s" for name, run in runs.items())
    yield f"  from home to home, {record['cycles']} x: {phases}"
    for name, words in transfers.items():
        yield f"  {name}: {words}"


def _drift_rows(repeatability: Record) -> Iterator[Row]:
    """The largest drift of a joint over a cycle; nothing if all joints return."""
    for name, joint_drift in repeatability.items():
        if joint_drift["closes"]:
            continue
        subject = "all tasks" if name == "all" else f"task {name}"
        of_cycles = f"cycle {{}} of {joint_drift['cycles']}" if joint_drift["cycles"] > 1 else "the cycle"
        for unit, joint, cycle in (("deg", "joint", "at_cycle"), ("mm", "sliding_joint", "sliding_at_cycle")):
            if f"worst_drift_{unit}" in joint_drift:
                where = of_cycles.format(joint_drift[cycle])
                drift = joint_drift[f"worst_drift_{unit}"]
                yield "largest joint drift", f"{drift:.4g} {unit}", f"{joint_drift[joint]} in {where} of {subject}"


def _clearance_rows(clearance: Record) -> Iterator[Row]:
    """The smallest distance of all, and those of the classes that it does not belong to."""
    for words, minimum in {"smallest clearance": clearance["whole"], **other_classes(clearance)}.items():
        if minimum["minimum_mm"] is None or not minimum["pair"]:
            continue
        first, second = minimum["pair"]
        proof = "certified" if minimum["certified"] else "not certified"
        least = "" if minimum.get("exact", True) else "at least "
        rests_on = accuracy_note(minimum["pair"], minimum.get("accuracies_mm"))
        where = f"{first} - {second} {instant_text(minimum)}{f', {rests_on}' if rests_on else ''}"
        label = words if minimum is clearance["whole"] else f"  {words}"
        yield label, f"{least}{floored(minimum['minimum_mm'])} mm, {proof}", where


def _slack_rows(slack: Record | None) -> Iterator[Row]:
    """The largest task slack."""
    if slack and slack["max"]:
        yield "largest task slack", f"{slack['max']:.2g}", f"{slack['unit']} {instant_text(slack, 'max_at_s')}"


def _integration_lines(solver: Record) -> Iterator[str]:
    """Why a method has no accurate mode; the time at which collocation failed."""
    if not METHODS[solver["method"]].is_accurate:
        yield f"  note: {no_accurate_mode(solver['method'])}"
    resolution = solver.get("resolution")
    if resolution and solver["integrator"] == "accurate" and resolution["euler_from_s"] is not None:
        lost = resolution.get("lost")
        reason = f"; {lost['message']}" if lost else ""
        goals = "; smaller gains of the secondary goals may help" if solver.get("secondary") else ""
        yield f"  collocation failed at {resolution['euler_from_s']:.3f} s; continued with Euler steps{reason}{goals}"


def _tilt_lines(record: Record) -> Iterator[str]:
    """Which tools keep an axis that may lean, as the method does not let them."""
    method = record["solver"]["method"]
    names = [name for name, task in record["tasks"].items() if "allowed_tilt_deg" in task]
    if names and not METHODS[method].lets_axes_lean:
        users = ", ".join(name for name, traits in METHODS.items() if traits.lets_axes_lean)
        yield f"  note: {method} keeps tool axes that may lean (tilt_deg of {', '.join(names)}); {users} lets them lean"


def _place_lines(folder: Path) -> Iterator[str]:
    yield f"report: {folder / 'report.html'}"
    for tables in (folder / "tables", folder / "rejected"):
        if tables.is_dir():
            yield f"tables: {tables}"


def _short(value: float | None) -> str:
    return "unknown" if value is None else small(value)


def stop_rows(record: Record) -> Iterator[Row]:
    """The deepest tool and the nearest robots when one robot stops; none where no controller says how others go on."""
    if "stops" not in record:
        return
    depths = record["stops"]["depths"]
    if depths:
        task = max(depths, key=lambda name: float(depths[name]["depth_mm"]))
        yield "depth at a stop", f"{small(depths[task]['depth_mm'])} mm", f"task {task}{_when(depths[task]['worst'])}"
    apart = [distance for distance in record["stops"]["distances"] if distance["distance_mm"] is not None]
    if apart:
        nearest = min(apart, key=lambda distance: float(distance["distance_mm"]))
        bodies = "" if nearest["bodies"] is None else " - ".join(nearest["bodies"])
        yield "clearance at a stop", f"{small(nearest['distance_mm'])} mm", f"{bodies}{_when(nearest['worst'])}"
    for robot, grip in record["stops"]["grips"].items():
        yield "grip at a stop", f"{small(grip['distance_mm'])} mm", f"{robot} from its grasp{_when(grip['worst'])}"


def _when(worst: Record | None) -> str:
    """Who stops when, and how far the other one has gone."""
    if worst is None:
        return ""
    return f", {worst['stopped']} stops at {worst['at_s']:.3f} s, {worst['going']} {worst['goes_on_ms']:.0f} ms farther"


def acceleration_rows(record: Record) -> Iterator[Row]:
    """Rows about the accelerations of a run; none for a record without them."""
    accelerations = record.get("accelerations")
    if accelerations is not None:
        yield from _joint_rows(record["joints"])
        yield from _world_rows(accelerations)


def not_judged_lines(record: Record) -> Iterator[str]:
    """One line for each quantity that was not judged, with its robots and the reason."""
    robots: dict[tuple[str, str], list[str]] = {}
    for left in (record.get("accelerations") or {"not_judged": []})["not_judged"]:
        robots.setdefault((left["what"], left["reason"]), []).extend([left["robot"]] if left["robot"] else [])
    for (what, reason), names in robots.items():
        of = f" of {', '.join(names)}" if names else ""
        yield f"  not judged: {what}{of} ({reason})"


def _joint_rows(joints: Record) -> Iterator[Row]:
    """The joint with the largest fraction of its limit, or else the largest acceleration; the largest jerk."""
    uses = [(f"{robot} {name}", use) for robot, named in joints.items() for name, use in named.items()]
    known = [use for use in uses if use[1].get("peak_acceleration") is not None]
    limited = [entry for entry in known if entry[1]["acceleration_ratio"] is not None]
    if limited:
        joint, use = max(limited, key=lambda entry: float(entry[1]["acceleration_ratio"]))
        source = "assumed" if use["acceleration_limit_source"] == "assumed" else "stated"
        figure = f"{percent(use['acceleration_ratio'], 1)} of its {source} limit"
        yield "largest joint acceleration", figure, f"{joint} {instant_text(use, 'peak_acceleration_at_s')}"
    elif known:
        joint, use = max(known, key=lambda entry: (entry[1]["unit"] == "deg", entry[1]["peak_acceleration"]))
        figure = f"{fixed(use['peak_acceleration'])} {use['unit']}/s2, not limited"
        yield "largest joint acceleration", figure, f"{joint} {instant_text(use, 'peak_acceleration_at_s')}"
    if known:
        joint, use = max(known, key=lambda entry: (entry[1]["unit"] == "deg", entry[1]["peak_jerk"]))
        figure = f"{fixed(use['peak_jerk'], 0)} {use['unit']}/s3 over {use['jerk_window_ms']:g} ms"
        yield "largest joint jerk", figure, f"{joint} {instant_text(use, 'peak_jerk_at_s')}"


def _world_rows(accelerations: Record) -> Iterator[Row]:
    """The tool tip and the part with the largest acceleration."""
    if accelerations["tools"]:
        robot, tool = max(accelerations["tools"].items(), key=lambda it: it[1]["peak_acceleration_m_s2"])
        yield "largest tool acceleration", *_figure(tool, f"tool tip of {robot}")
    if accelerations["part"] is not None:
        yield "largest part acceleration", *_figure(accelerations["part"]["corner"], "part")


def _figure(point: Record, what: str) -> tuple[str, str]:
    """Figure of a point, and when it is reached."""
    return f"{small(point['peak_acceleration_m_s2'])} m/s2", f"{what} {instant_text(point, 'peak_acceleration_at_s')}"


def failure_lines(checks: Iterable[Record], more: str) -> Iterator[str]:
    """A line for each failed check below a heading for each group; those not shown stand at ``more``."""
    groups: dict[str, list[str]] = {}
    for check in checks:
        if not check["passed"]:
            phase = f"{check['phase']}: " if check.get("phase") else ""
            groups.setdefault(CHECK_KINDS[check["name"]].heading, []).append(f"{phase}{check['message']}")
    for title, messages in groups.items():
        yield f"  {title}: {len(messages)} failed"
        yield from (f"    FAILED {message}" for message in messages[:MOST_OF_A_GROUP])
        if len(messages) > MOST_OF_A_GROUP:
            yield f"    and {len(messages) - MOST_OF_A_GROUP} more, all in {more}"


def count_text(checks: Iterable[Record]) -> str:
    """How many checks passed or failed."""
    outcomes = [bool(check["passed"]) for check in checks]
    failed = outcomes.count(False)
    if failed:
        return f"{failed} of {len(outcomes)} checks failed"
    return f"{len(outcomes)} checks passed" if len(outcomes) != 1 else "1 check passed"
