"""What was read from exported files against what was written: the same rows, marks and process."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.transforms import rotation_vector
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportJob, ProgramRows, RobotRows
from cellplan.model.units import DEG, MM
from cellplan.programs.elements.corners import moves, row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import Angle, from_numbers, in_step, to_numbers
from cellplan.programs.elements.timed_rows import decimals_of

TIME_ROUNDING: Final = 0.5001e-3  # [s] formats write times with three decimals or more; half of the last one
ROUNDING_TOL: Final = 1e-9  # [rad] or [m] arithmetic of units and zeros
QUANTA: Final = 2.01  # [-] of the last decimal of a degree or millimetre: two axes that are coupled round by one each
SHARE_TOL: Final = 0.02  # [-] zones are sizes, of segments between rows that are rounded; what is read is judged
FEED_TOL: Final = 1e-6  # [m/s], or as joint speeds are stated: three decimals at most
SEAM_PLACE: Final = 1e-5  # [mm] languages of radians state places in metres
SEAM_TURN: Final = 2e-3  # [deg] three angles with three decimals, each off by half of the last one, turn by half of it
SOLVED_TOL: Final = 1e-4  # [rad] or [m] positions that are worked out again from poses of tools


def other_rows(dialect: Dialect, job: ExportJob, read: tuple[ProgramRows, ...]) -> Iterator[str]:
    """What differs between the rows that were written and those that were read, the first of each robot."""
    if len(read) != len(job.programs):
        yield f"expected {len(job.programs)} programs, read {len(read)}"
        return
    for written, recovered in zip(job.programs, read, strict=True):
        where = "" if written.name is None else f"program '{written.name}', "
        if recovered.name != written.name:
            yield f"expected a program named {written.name!r}, read {recovered.name!r}"
        if set(recovered.robots) != set(written.robots):
            yield f"{where}expected rows of {', '.join(written.robots)}, read those of {', '.join(recovered.robots)}"
            continue
        shares = row_shares(job, written)
        for name, rows in written.robots.items():
            finding = _other(dialect, job, rows, recovered.robots[name])
            finding = finding or _other_rounding(rows, recovered.robots[name], shares[name])
            finding = finding or _other_speed(dialect, job, written, recovered.robots[name])
            if finding is not None:
                yield f"{where}robot '{name}': {finding}"


def _other(dialect: Dialect, job: ExportJob, written: RobotRows, read: RobotRows) -> str | None:
    """The first difference between rows of one robot; None where they are the same."""
    if read.q.shape != written.q.shape:
        return f"expected {len(written)} rows of {written.q.shape[1]} joints, read {len(read)} of {read.q.shape[1]}"
    on_seam = written.on_seam
    if not np.all(np.isfinite(read.q[~on_seam])):
        return "read a position that is not a finite number"
    if read.marks != written.marks:
        return f"expected waits at rows {list(written.marks)}, read {list(read.marks)}"
    return (
        _other_process(written, read)
        or _other_time(written, read)
        or _other_seam(dialect, job, written, read)
        or _other_position(dialect, job, written, read)
    )


def _other_seam(dialect: Dialect, job: ExportJob, written: RobotRows, read: RobotRows) -> str | None:
    """The first row of a seam that is not as written: its pose, its speed, or whether an arc leads through it."""
    if written.seams != read.seams:
        return f"expected the seams {_shown(written)}, read {_shown(read)}"
    decimals = decimals_of(job.frame.robot(written.robot), dialect.decimals)
    for seam in written.seams:
        for row in range(seam.first + 1, seam.last + 1):
            finding = _other_move(written, read, row, quantum=max(QUANTA * 10.0**-decimals, SEAM_PLACE))
            if finding is not None:
                return f"row {row + 1}, task '{seam.task}': {finding}"
    return None


def _other_move(written: RobotRows, read: RobotRows, row: int, *, quantum: float) -> str | None:
    """What differs of a line or an arc to a row; its place may differ by so much in [mm]."""
    if written.X_PT is None or written.feeds is None or written.middles is None:
        raise ValueError(f"rows of '{written.robot}': expected poses and speeds of their seams")
    if read.X_PT is None or read.feeds is None or read.middles is None:
        return "expected a pose and a speed, read none"
    off = MM * float(np.linalg.norm(read.X_PT[row, :3, 3] - written.X_PT[row, :3, 3]))
    turned = DEG * float(np.linalg.norm(rotation_vector(read.X_PT[row, :3, :3].T @ written.X_PT[row, :3, :3])))
    if not (off <= quantum and turned <= SEAM_TURN) and np.any(np.isnan(read.q[row])):  # or else joints are compared
        return f"read a pose that is {off:.3g} mm and {turned:.3g} deg from what is written"
    if not abs(read.feeds[row] - written.feeds[row]) <= FEED_TOL:
        return f"expected a speed of {MM * written.feeds[row]:.6g} mm/s, read {MM * read.feeds[row]:.6g} mm/s"
    if read.middles[row] != written.middles[row]:
        return f"expected {'an arc through it' if written.middles[row] else 'a line'}, read the other"
    return None


def _shown(rows: RobotRows) -> str:
    """Seams in messages."""
    return ", ".join(f"{seam.task} at rows {seam.first + 1} to {seam.last + 1}" for seam in rows.seams) or "none"


def _other_rounding(written: RobotRows, read: RobotRows, shares: Array) -> str | None:
    """The first row that is rounded more than it may be; None also where the format states nothing of it."""
    if read.rounding is None:
        return None
    beyond = np.all(moves(written), axis=0) & ~(read.rounding <= shares * (1.0 + SHARE_TOL))
    if not np.any(beyond):
        return None
    row = int(np.argmax(beyond))
    expected = f"rounding of at most {shares[row]:.3g} of the shorter segment" if shares[row] > 0.0 else "a stop"
    return f"row {row + 1}: expected {expected}, read {read.rounding[row]:.3g}"


def _other_process(written: RobotRows, read: RobotRows) -> str | None:
    """The first row from which on the process is not as written; None also where the format states none."""
    if read.process is None or written.process is None or np.array_equal(read.process, written.process):
        return None
    row = int(np.argmax(read.process != written.process))
    on, off = ("on", "off") if written.process[row] else ("off", "on")
    return f"expected a process that is {on} from row {row + 1} on, read {off}"


def _other_time(written: RobotRows, read: RobotRows) -> str | None:
    """The first time that is not as written; None also where the format states none."""
    if read.durations is not None and written.times is not None:
        expected = np.diff(written.times)
        late = np.abs(read.durations[1:] - expected) > TIME_ROUNDING
        if np.any(late):
            row = int(np.argmax(late))
            return f"row {row + 2}: expected a motion of {expected[row]:.6g} s, read {read.durations[row + 1]:.6g} s"
    if read.times is None or written.times is None:
        return None
    late = ~(np.abs(read.times - written.times) <= TIME_ROUNDING)
    late[1:] |= ~(np.diff(read.times) > 0.0)
    if not np.any(late):
        return None
    row = int(np.argmax(late))
    return f"row {row + 1}: expected the time {written.times[row]:.6g} s, read {read.times[row]:.6g} s"


def _other_speed(dialect: Dialect, job: ExportJob, written: ProgramRows, read: RobotRows) -> str | None:
    """The first row to which the joints do not move as fast as written; in step all robots move as the fastest one."""
    if dialect.speeds is None or read.speeds is None:
        return None
    names = in_step(job.frame, read.robot)
    expected = np.max([dialect.speeds(job.frame.robot(name), written.robots[name]) for name in names], axis=0)
    off = np.abs(read.speeds - expected) > FEED_TOL
    if not np.any(off):
        return None
    row = int(np.argmax(off))
    return f"row {row + 1}: expected a speed of the joints of {expected[row]:.6g}, read {read.speeds[row]:.6g}"


def _other_position(dialect: Dialect, job: ExportJob, written: RobotRows, read: RobotRows) -> str | None:
    """The first position that is not as written."""
    robot = job.frame.robot(written.robot)
    off = _off(robot, dialect, written.q, read.q, is_solved=dialect.states_poses(job.frame))
    off[written.on_seam & np.any(np.isnan(read.q), axis=1)] = False
    if not np.any(off):
        return None
    row, index = (int(place) for place in np.argwhere(off)[0])
    joint = robot.model.joints[index]
    unit, scale = joint.display_unit
    return (
        f"row {row + 1}: expected joint {joint.name} at {scale * written.q[row, index]:.6g} {unit}, "
        f"read {scale * read.q[row, index]:.6g} {unit}"
    )


def _off(robot: Robot, dialect: Dialect, written: Array, read: Array, *, is_solved: bool) -> Flags:
    """Positions that are farther from those that were written than rounding takes them, shape (N, n)."""
    if is_solved:
        return np.abs(read - written) > SOLVED_TOL
    decimals = decimals_of(robot, dialect.decimals) if dialect.kinds else dialect.decimals
    units = np.array([joint.display_unit.scale for joint in robot.model.joints])
    off = np.ones(written.shape, dtype=bool)
    for angle, quantum in ((Angle.DEGREES, QUANTA * 10.0**-decimals / units), (Angle.RADIANS, 0.0)):
        expected = _rounded(robot, written, decimals, angle)
        off &= ~(np.abs(read - expected) <= quantum + ROUNDING_TOL)
    return off


def _rounded(robot: Robot, written: Array, decimals: int, angle: Angle) -> Array:
    """Positions as they are read back from their numbers; as they are where no number is within the limits."""
    try:
        return from_numbers(robot, to_numbers(robot, written, decimals=decimals, angle=angle), angle=angle)
    except InputError:  # they are beyond a limit, which is a finding of its own
        return written
