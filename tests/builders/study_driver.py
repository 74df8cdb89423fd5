"""A study in a process of its own, to be killed: ``python -m builders.study_driver FOLDER TRIALS WORKERS PIDS``."""

import signal
import sys
from pathlib import Path

from builders.study_trials import Noted, rounds
from cellplan.cli.main import INTERRUPTIONS
from cellplan.study.study import Stop


def main() -> None:
    """Run or continue the study; a line on the output for every trial that is recorded."""
    for number in INTERRUPTIONS:
        signal.signal(number, signal.default_int_handler)
    folder, trials, workers, pids = sys.argv[1:]
    study = rounds(Path(folder), size=8)
    try:
        study.run(
            Noted(Path(pids)),
            workers=int(workers),
            stop=Stop(trials=int(trials)),
            resume=True,
            progress=lambda stage, _share: print(stage, flush=True),  # noqa: T201
        )
    except KeyboardInterrupt as error:
        print(error, flush=True)  # noqa: T201
        sys.exit(130)


if __name__ == "__main__":
    main()
