"""The reference job, resolved by cellplan and by its peers: ``python benchmarks/peers.py``.

Each engine has a process of its own with its own libraries. All are ready before the first round; the rounds alternate
between the engines, so that a slow minute hits all alike. Processor time is that of the run alone, models and targets
built beforehand. Peers that are not installed are left out, with a word on why.
"""

import json
import statistics
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
from engines import ENGINES, PEERS
from job import Job
from options import benchmark_options
from reference_job import BETWEEN, Errors, Judge, reference_job
from sections import Goal, Section, digits, table
from workers import Worker

MB: Final = 1e6  # [bytes]
RIVALS: Final = ("Pink", "mink")
TIMES_FASTER: Final = 15.0  # [-] goal beside the rivals
HEAD: Final = (
    "engine",
    "CPU",
    "per sample",
    "× ours",
    "error at the samples",
    "between, straight",
    "between, smooth",
    "orientation",
    "end off by",
    "peak memory",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What an engine made of the job.

    Attributes:
        version: Version of its package.
        cpu_s: Median processor time in [s].
        peak_bytes: Largest memory of its process.
        errors: What is wrong with its joints.
    """

    version: str
    cpu_s: float
    peak_bytes: float
    errors: Errors


def measure(job: Job, rounds: int) -> tuple[dict[str, Result], dict[str, str]]:
    """Results of the engines that take part, and why the others do not, both by name."""
    with tempfile.TemporaryDirectory(prefix="cellplan-bench-") as home:
        workers = [Worker(engine, job, Path(home)) for engine in ENGINES]
        try:
            for worker in workers:
                worker.get_ready()
            for number in range(rounds + 1):
                print(f"reference job: {f'round {number} of {rounds}' if number else 'warming up'}", file=sys.stderr)
                for worker in workers:
                    worker.run(counts=number > 0)
            joints = {worker.engine.name: worker.joints() for worker in workers}
        finally:
            for worker in workers:
                worker.end()
    judge = Judge(job)
    results = {
        worker.engine.name: Result(
            version=worker.version,
            cpu_s=statistics.median(worker.cpu_s),
            peak_bytes=worker.peak_bytes,
            errors=judge.errors(q),
        )
        for worker in workers
        if (q := joints[worker.engine.name]) is not None
    }
    return results, {worker.engine.name: worker.problem for worker in workers if worker.problem}


def section(rounds: int) -> Section:
    """The benchmark as a section of the page."""
    job = reference_job()
    results, left_out = measure(job, rounds)
    return Section(
        title="The reference job, beside other libraries",
        lines=[
            "The robots, the part and the tasks of Ribeiro's thesis (2010), tables 4–7: 24 joints, three tools that "
            f"keep their whole pose on the moving part, 4 s at 1 ms, {len(job.times) - 1} steps "
            "(`cells/four_robots.yaml`). "
            "Every engine is given the start posture, the desired pose of each tool on the part at each sample, as its "
            "own types, and one model of all robots, all built beforehand; it gives back the joints at each sample. "
            "Limits and collisions are not considered.",
            "",
            *table(HEAD, [_row(name, result, results, steps=len(job.times) - 1) for name, result in results.items()]),
            "",
            f"CPU: median of {rounds} runs after one that does not count, one thread, each engine in a process of its "
            "own, in turns. Errors: largest position error of a tool on the part, found by the kinematics of "
            f"cellplan's checks, which no engine uses; *between* also at {BETWEEN} places between each two samples, "
            "when the joints go straight from sample to sample or along the cubic through the four nearest samples. "
            "Orientation: largest error, straight. *End off by*: largest distance of a joint at the end from where "
            "infinitely small steps of least joint motion lead (two runs of small Euler steps, extrapolated): how well "
            "the redundancy is resolved. Memory: the whole process, its libraries and the job.",
            "",
            "The accurate mode is not quick because its steps are: those of a solver in C++ are quicker. It takes "
            "fewer of them, knows the error between them and follows the redundancy to a higher order. The last rows "
            "show how far others come with fewer steps: the tools stay on their tasks, while the joints drift away "
            "from the motion that was asked for.",
            "",
            *(f"- **{', '.join(names)}**: {choices}." for choices, names in _choices(results).items()),
            *(f"- {name} was left out: {problem}." for name, problem in left_out.items()),
        ],
        goals=goals(results),
    )


def goals(results: Mapping[str, Result]) -> list[Goal]:
    """What the engines of cellplan were to reach, alone and beside their rivals."""
    collected = []
    for engine in ENGINES:
        if engine.goal_s is None or engine.goal_m is None or engine.name not in results:
            continue
        result = results[engine.name]
        error, rivals = result.errors.smooth, {name: results[name] for name in RIVALS if name in results}
        collected.append(
            Goal(
                text=f"{engine.name}: at most {1e3 * engine.goal_s:g} ms, and {digits(1e3 * engine.goal_m)} mm between",
                measured=f"{1e3 * result.cpu_s:.0f} ms, {digits(1e3 * error)} mm",
                met=result.cpu_s <= engine.goal_s and error <= engine.goal_m,
            )
        )
        collected += [
            Goal(
                text=f"{engine.name}: at least {TIMES_FASTER:g} times faster than {name} at no larger error",
                measured=f"{rival.cpu_s / result.cpu_s:.1f} times, {digits(1e3 * error)} mm to "
                f"{digits(1e3 * rival.errors.smooth)} mm",
                met=rival.cpu_s >= TIMES_FASTER * result.cpu_s and error <= rival.errors.smooth,
            )
            for name, rival in rivals.items()
            if engine is ENGINES[0]
        ]
    return collected


def _choices(results: Mapping[str, Result]) -> dict[str, list[str]]:
    """Names and versions of the engines that took part, by what was chosen for them."""
    collected: dict[str, list[str]] = {}
    for engine in ENGINES:
        if engine.name in results:
            version = f" {results[engine.name].version}" if engine in PEERS else ""
            collected.setdefault(engine.choices, []).append(f"{engine.name}{version}")
    return collected


def _row(name: str, result: Result, results: Mapping[str, Result], *, steps: int) -> list[str]:
    """One line of the table."""
    errors = result.errors
    return [
        name,
        f"{1e3 * result.cpu_s:.0f} ms",
        f"{1e6 * result.cpu_s / steps:.0f} µs",
        digits(result.cpu_s / results[ENGINES[0].name].cpu_s),
        *(f"{digits(1e3 * error)} mm" for error in (errors.samples, errors.lines, errors.smooth)),
        f"{digits(float(np.degrees(errors.orientation)))}°",
        f"{digits(float(np.degrees(errors.end)))}°",
        f"{result.peak_bytes / MB:.0f} MB",
    ]


def main() -> None:
    """Measure and print."""
    options = benchmark_options(
        "Resolve the reference job by cellplan and its peers.", what="runs of each engine", rounds=5
    )
    if options.json:
        results, left_out = measure(reference_job(), options.rounds)
        result = {name: asdict(result) for name, result in results.items()}
        print(json.dumps({"results": result, "left_out": left_out}, indent=1))
        return
    print(section(options.rounds).text())


if __name__ == "__main__":
    main()
