"""A recovery as record, text and files: what is shown, and in which order."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.certify.growth import ComingApart
from cellplan.files.input.files import digest
from cellplan.files.input.findings import listed
from cellplan.files.run.content import PROGRAMS, RECOVERY
from cellplan.files.run.folder import RunFolder
from cellplan.files.run.joint_tables import program_digest, table_body
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.judge import Nearest, TimedPhase
from cellplan.jobs.recover.programs import RecoveryPrograms
from cellplan.jobs.recover.recover import Recovery
from cellplan.model.cell.cell import Robot
from cellplan.model.report.report import CAUTION
from cellplan.model.units import MM
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.runs.write_run import versions

SCHEMA: Final = "cellplan.recovery/1"
CLOCK: Final = "tables/clock.csv"  # what is done at each row, as in a run
TITLE: Final = "cellplan recovery clock v1"
LONGEST: Final = 3  # ways that were not taken that are shown

Programs = Mapping[str, RecoveryPrograms]
NONE: Final[Programs] = {}


# The record: recovery.json


def recovery_record(recovery: Recovery, programs: Programs = NONE) -> dict[str, Any]:
    """What ``recovery.json`` says, in deg, mm and s, of a recovery and its programs by format."""
    record: dict[str, Any] = {
        "schema": SCHEMA,
        "status": "found" if recovery.succeeded else "not_found",
        "cell": recovery.cell.name,
        "run": recovery.run,
        "versions": versions(),
        "state": _state(recovery),
        "limits": recovery.cell.program.transfer.model_dump(),
    }
    if recovery.judgement is None:
        blocked = {"blocked": None} if recovery.blocked is None else recovery.blocked.details
        return record | {"reason": recovery.reason, **blocked, "files": {}, "caution": CAUTION}
    judgement = recovery.judgement
    record["duration_s"] = recovery.duration
    record["phases"] = [_phase(phase) for phase in judgement.phases]
    record["clearance"] = _nearest(judgement.nearest)
    record["begins_too_near"] = [_apart(pair, met_from) for pair, met_from in judgement.apart]
    record["not_taken"] = list(recovery.tried)
    record["checks"] = [
        {"name": check.name, "subject": check.subject, "passed": check.passed, "message": check.message}
        for check in judgement.checks
    ]
    record |= {"programs": {form: written.record for form, written in programs.items()}} if programs else {}
    files = {name: digest(text.encode()) for name, text in _files(recovery, programs).items()}
    return record | {"files": files, "caution": CAUTION}


def _state(recovery: Recovery) -> dict[str, Any]:
    """Where the cell has stopped."""
    state, cell = recovery.state, recovery.cell
    robots = {
        robot.name: {
            "at_s": state.times[robot.name],
            "keeps": robot.name in state.standing,
            "joints": _joints(robot, state.q[cell.columns(robot.name)]),
        }
        for robot in cell.robots
    }
    part = "lies without a holder" if state.lying is not None else "as the program has it"
    return {"at_s": state.at, "robots": robots, "part": part}


def _phase(phase: TimedPhase) -> dict[str, Any]:
    return {
        "kind": phase.kind,
        "robots": list(phase.robots),
        "what": phase.words,
        "begin_s": phase.begin,
        "end_s": phase.end,
        "duration_s": round(phase.end - phase.begin, TIME_DECIMALS),
        "clearance": _nearest(phase.nearest),
    }


def _apart(pair: ComingApart, met_from: float | None) -> dict[str, Any]:
    """A pair that begins too near as data."""
    return {
        "pair": list(pair.names),
        "distance_mm": max(0.0, MM * pair.begin),
        "depth_mm": max(0.0, -MM * pair.begin),
        "demand_mm": MM * pair.demand,
        "kept_from_s": met_from,
        "may_fall_back_mm": MM * pair.slack,
    }


def _nearest(nearest: Nearest | None) -> dict[str, Any] | None:
    """A smallest distance as data."""
    if nearest is None:
        return None
    return {
        "distance_mm": MM * nearest.distance,
        "demand_mm": MM * nearest.demand,
        "pair": list(nearest.pair),
        "at_s": nearest.at_s,
    }


def _joints(robot: Robot, q: Array) -> dict[str, float]:
    """Joint positions in the units of the tables."""
    return {
        f"{joint.name}_{joint.display_unit.name}": joint.display_unit.scale * value
        for joint, value in zip(robot.model.joints, q.tolist(), strict=True)
    }


# Text


def recovery_lines(record: Mapping[str, Any]) -> list[str]:
    """The lines of a record in ``recovery.json``."""
    at = record["state"]["at_s"]
    if record["status"] != "found":
        return [f"{record['cell']}: no recovery from {at:g} s was found", f"  {record['reason']}"]
    lines = [f"{record['cell']}: recovery from {at:g} s, {record['duration_s']:.3f} s"]
    lines += [*_state_lines(record), *_limit_lines(record["limits"])]
    for number, phase in enumerate(record["phases"], start=1):
        lines.append(f"  {number}. {phase['begin_s']:.3f} to {phase['end_s']:.3f} s  {phase['kind']}: {phase['what']}")
    nearest = record["clearance"]
    if nearest is not None:
        shown = np.floor(10.0 * nearest["distance_mm"]) / 10.0  # never more than there is
        lines.append(
            f"  smallest clearance {shown:.1f} mm ({' to '.join(nearest['pair'])} at "
            f"{nearest['at_s']:.3f} s), required {nearest['demand_mm']:.1f} mm"
        )
    lines += [f"  not taken: {words}" for words in record["not_taken"][:LONGEST]]
    return [*lines, *_program_lines(record.get("programs", {}))]


def _program_lines(programs: Mapping[str, Any]) -> Iterator[str]:
    """What is promised of the programs in each format."""
    for form, program in programs.items():
        marks = max(map(len, program["marks"].values()))
        met = f", all robots of the cell wait at {marks} marks" if marks else ""
        yield f"  {form}: {', '.join(program['robots'])}: {program['promise']}{met}"
        if program["by_hand"]:
            yield f"    no format writes the waits of {listed(program['by_hand'])}: program them by hand"


def _state_lines(record: Mapping[str, Any]) -> Iterator[str]:
    """Where robots stand at other times, and what begins too near."""
    at = record["state"]["at_s"]
    for name, robot in record["state"]["robots"].items():
        if robot["at_s"] != at:
            yield f"  {name} stands where it is at {robot['at_s']:g} s"
        if robot["keeps"]:
            yield f"  {name} stands still"
    for pair in record["begins_too_near"]:
        first, second = pair["pair"]
        held = f"{pair['depth_mm']:.2f} mm deep in" if pair["depth_mm"] > 0.0 else f"{pair['distance_mm']:.2f} mm from"
        distance = f"from {pair['kept_from_s']:.3f} s on {pair['demand_mm']:g} mm apart"
        yield f"  begins with {first} {held} {second}; {distance}"


def _limit_lines(limits: Mapping[str, Any]) -> Iterator[str]:
    """How fast the moves are at most, where that is less than robots can do."""
    if limits["speed_percent"] < 100.0:
        yield f"  no joint faster than {limits['speed_percent']:g} % of its limit"
    if limits["tcp_mm_s"] is not None:
        yield f"  no tool tip, flange or point of a held part faster than {limits['tcp_mm_s']:g} mm/s"


# Files


def write_recovery(recovery: Recovery, folder: Path, programs: Programs = NONE) -> dict[str, Any]:
    """Write a recovery, its tables and their clock; its folder appears whole or not at all, in place of an older one.

    Args:
        recovery: The recovery; without tables where none was found.
        folder: Where its files go.
        programs: Its programs by format.

    Returns:
        The record in ``recovery.json``.

    Raises:
        InputError: The folder cannot be written, or holds something else.
    """
    record = recovery_record(recovery, programs)
    with RunFolder(folder) as target:
        target.write_text(RECOVERY, json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
        for name, text in _files(recovery, programs).items():
            target.write_text(name, text)
    return record


def clock_text(recovery: Recovery) -> str:
    """What is done at each row of the tables: time, number of the phase from 1, kind, and the robots that move.

    A row at which one phase ends and another begins counts to the later one.
    """
    if recovery.judgement is None:
        raise ValueError("expected a recovery that was found")
    phases = recovery.judgement.phases
    begins = np.array([phase.begin for phase in phases])
    lines = [f"# {TITLE}", f"# cell: {recovery.cell.name}"]
    lines += [f"# program digest: sha256 {program_digest(recovery.tables)}", "time_s,number,phase,robots"]
    for line in table_body(next(iter(recovery.tables.values()))).splitlines()[1:]:
        time = line.partition(",")[0]
        place = int(np.searchsorted(begins, float(time), side="right")) - 1
        lines.append(f"{time},{place + 1},{phases[place].kind},{' '.join(phases[place].robots)}")
    return "\n".join(lines) + "\n"


def _files(recovery: Recovery, programs: Programs) -> dict[str, str]:
    """Text of every file beside the record, by its path; none where no recovery was found."""
    if not recovery.succeeded:
        return {}
    tables = {f"tables/{name}.csv": text for name, text in recovery.tables.items()}
    of_programs = {
        f"{PROGRAMS}/{form}/{path}": text for form, one in programs.items() for path, text in one.files.items()
    }
    return {CLOCK: clock_text(recovery), **tables, **of_programs}
