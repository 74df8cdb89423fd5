"""Run all benchmarks, print what they say and write docs/benchmarks.md: ``make bench``.

Each benchmark is a script beside this one that also runs alone. Here each runs in a process of its own: what one has
loaded into memory is not to be seen in the figures of the next.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

from sections import ONE_THREAD, machine

HERE: Final = Path(__file__).resolve().parent
PAGE: Final = HERE.parent / "docs/benchmarks.md"
SCRIPTS: Final = ("peers", "scaling", "screening", "clearance", "dual_robots", "live_verdicts", "commands")
HEAD: Final = """# Benchmarks

`make bench` measures all of this anew and writes this page. **Compare ratios**, between two machines or two versions;
seconds depend on the machine and on the day. What is compared was measured in one run, in turns, with one thread.
"""


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description="Run the benchmarks of cellplan and write docs/benchmarks.md.")
    parser.add_argument("--rounds", type=int, default=5, help="runs of whatever is timed in turns (default: 5)")
    parser.add_argument("--only", choices=SCRIPTS, nargs="+", help="run these alone, and leave the page as it is")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    texts = [f"{HEAD}\nMeasured on: {machine()}.\n"]
    print(texts[0])
    for name in options.only or SCRIPTS:
        print(f"benchmark: {name}", file=sys.stderr)
        texts.append(said(name, options.rounds))
        print(texts[-1], flush=True)
    if not options.only:
        PAGE.write_text("\n".join(texts), encoding="utf-8")
        print(f"written: {PAGE.relative_to(HERE.parent)}", file=sys.stderr)


def said(name: str, rounds: int) -> str:
    """What one benchmark prints; the program ends when it fails."""
    command = [sys.executable, str(HERE / f"{name}.py"), "--rounds", str(rounds)]
    environment = {**os.environ, **ONE_THREAD}
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=False)
    if done.returncode != 0:
        sys.exit(f"benchmark: {name} failed")
    return done.stdout


if __name__ == "__main__":
    main()
