"""Accelerations as text: the joint closest to its limit, jerk, tool and part, and what was not judged."""

from collections.abc import Iterable, Iterator

from cellplan.report.record.common import Record


def acceleration_lines(record: Record) -> Iterator[str]:
    """Lines about the accelerations of a run; none for a record without them."""
    accelerations = record.get("accelerations")
    if accelerations is None:
        return
    yield from _joint_lines(record["joints"])
    yield from _world_lines(accelerations)
    yield from _not_judged_lines(accelerations["not_judged"])


def _joint_lines(joints: Record) -> Iterator[str]:
    """The joint with the largest fraction of its limit, or else the largest acceleration; the largest jerk."""
    uses = [(f"{robot} {name}", use) for robot, named in joints.items() for name, use in named.items()]
    known = [each for each in uses if each[1].get("peak_acceleration") is not None]
    limited = [each for each in known if each[1]["acceleration_ratio"] is not None]
    if limited:
        joint, use = max(limited, key=lambda each: float(each[1]["acceleration_ratio"]))
        source = "assumed" if use["acceleration_limit_source"] == "assumed" else "stated"
        figure = f"{100.0 * use['acceleration_ratio']:.4g} % of its {source} limit"
        yield f"  largest joint acceleration {figure}: {joint} at {use['peak_acceleration_at_s']:.3f} s"
    elif known:
        joint, use = max(known, key=lambda each: (each[1]["unit"] == "deg", each[1]["peak_acceleration"]))
        figure = f"{use['peak_acceleration']:.4g} {use['unit']}/s2, not limited"
        yield f"  largest joint acceleration {figure}: {joint} at {use['peak_acceleration_at_s']:.3f} s"
    if known:
        joint, use = max(known, key=lambda each: (each[1]["unit"] == "deg", each[1]["peak_jerk"]))
        figure = f"{use['peak_jerk']:.4g} {use['unit']}/s3 over {use['jerk_window_ms']:g} ms"
        yield f"  largest joint jerk {figure}: {joint} at {use['peak_jerk_at_s']:.3f} s"


def _world_lines(accelerations: Record) -> Iterator[str]:
    """The tool tip and the part with the largest acceleration."""
    texts = []
    if accelerations["tools"]:
        robot, tool = max(accelerations["tools"].items(), key=lambda it: it[1]["peak_acceleration_m_s2"])
        texts.append(f"of a tool tip {_figure(tool)} ({robot})")
    if accelerations["part"] is not None:
        texts.append(f"of the part {_figure(accelerations['part']['corner'])}")
    if texts:
        yield f"  largest acceleration {', '.join(texts)}"


def _not_judged_lines(entries: Iterable[Record]) -> Iterator[str]:
    """One line for each quantity that was not judged, with its robots and the reason."""
    robots: dict[tuple[str, str], list[str]] = {}
    for left in entries:
        robots.setdefault((left["what"], left["reason"]), []).extend([left["robot"]] if left["robot"] else [])
    for (what, reason), names in robots.items():
        of = f" of {', '.join(names)}" if names else ""
        yield f"  not judged: {what}{of} ({reason})"


def _figure(point: Record) -> str:
    return f"{point['peak_acceleration_m_s2']:.3g} m/s2 at {point['peak_acceleration_at_s']:.3f} s"
