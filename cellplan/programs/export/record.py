"""Record: what was exported from which run, what is promised of it and what was found in it."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from cellplan.files.input.files import digest
from cellplan.model.report.report import CAUTION
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.units import MM
from cellplan.programs.export.notes import deviation_line, deviation_records, skew_lines
from cellplan.programs.export.prepare import PreparedExport
from cellplan.programs.export.stored import SCHEMA
from cellplan.programs.export.written import Written
from cellplan.programs.promises.orders import Orders, OrderStretch
from cellplan.programs.promises.skew import PER_SECOND
from cellplan.report.record.sections.rests_on import zero_text
from cellplan.runs.write_run import versions

Record = dict[str, Any]


def export_record(run: VerifiedRun, prepared: PreparedExport, written: Written) -> Record:
    """What ``export.json`` says of an export by a dialect."""
    frame = written.job.frame
    about = {
        "promise": str(frame.promise),
        "asked_promise": None if prepared.requested is None else str(prepared.requested),
        "reasons": list(prepared.promised.reasons),
        "remarks": list(prepared.promised.remarks),
        "robots": list(frame.robots),
        "moves": str(frame.moves),
        "split": frame.split,
        "decimals": prepared.dialect.decimals,
        "allowed_skew": _skew(prepared),
        "deviation": deviation_line(written.judgement),
        "deviations": deviation_records(written.judgement),
        "not_judged": list(written.judgement.not_judged),
        "marks": [_marks(order, place, written) for place, order in enumerate(prepared.orders)],
        "thinning": None if prepared.thinning is None else dict(zip(("mm", "deg"), prepared.thinning, strict=True)),
        "blend": written.job.blend,
        "rounded": _rounded(written),
        **({"steps": True} if prepared.dialect.sets_steps else {}),
    }
    return _record(run, prepared.dialect.name, about, written.files)


def table_record(run: VerifiedRun, name: str, decimals: int, files: Mapping[str, str]) -> Record:
    """What ``export.json`` says of tables of all robots that no controller plays."""
    about = {"robots": [robot.name for robot in run.cell.robots], "decimals": decimals}
    return _record(run, name, about, files)


def record_text(record: Record) -> str:
    """The record as text, the same for the same record."""
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _rounded(written: Written) -> Record | None:
    """How many rows are rounded, and by how much more the tools may be off there."""
    judgement = written.judgement
    if not judgement.rounded[0]:
        return None
    return {
        "rows": judgement.rounded[0],
        "of": judgement.rounded[1],
        "corners": deviation_records(judgement, of_corners=True),
    }


def _record(run: VerifiedRun, name: str, about: Record, files: Mapping[str, str]) -> Record:
    """What all formats state."""
    return {
        "schema": SCHEMA,
        "cell": run.cell.name,
        "format": name,
        **about,
        "run": run.digest,
        **({"names": dict(run.names)} if run.names else {}),
        "versions": versions(),
        "zero": {robot.name: zero_text(robot.model) for robot in run.cell.robots},
        "files": {path: digest(text.encode()) for path, text in files.items()},
        "caution": CAUTION,
    }


def _skew(prepared: PreparedExport) -> Record | None:
    """What the start skew may be; None where no other controller shares the run, or no time is promised."""
    if prepared.skew is None:
        return None
    pairs = [
        {
            "robots": [pair.first, pair.second],
            "allowed_ms": PER_SECOND * pair.allowed,
            "stated_ms": None if pair.stated is None else PER_SECOND * pair.stated,
            "limit": pair.reason,
        }
        for pair in prepared.skew.pairs
    ]
    return {"line": next(skew_lines(prepared)), "pairs": pairs}


def _marks(orders: Orders, place: int, written: Written) -> Record:
    """Marks of one program: rows of the run, rows of each robot in its file, and what was certified between."""
    robot_rows = written.job.programs[place].robots
    return {
        "program": orders.program,
        "times_s": list(orders.times),
        "run_rows": list(orders.marks),
        "rows": {name: list(rows.marks) for name, rows in robot_rows.items()},
        "certified": [_stretch(stretch) for stretch in orders.stretches],
    }


def _stretch(stretch: OrderStretch) -> Record:
    """What was certified between two marks."""
    return {
        "phase": stretch.phase,
        "run_rows": [stretch.first, stretch.last],
        "pairs": [list(pair) for pair in stretch.pairs],
        "keeps_mm": round(MM * stretch.proved, 3) if np.isfinite(stretch.proved) else None,
    }
