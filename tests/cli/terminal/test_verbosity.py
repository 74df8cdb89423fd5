"""``-v``: stages with their times and counts, on the error stream and nowhere else."""

import logging
import re
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.cli.terminal.progress import progress_listener
from cellplan.cli.terminal.verbosity import STAGES, be_verbose

TIME = r"\s+\d+\.\d{3} s, processor\s+\d+\.\d{3} s"


def test_stages_are_timed_one_after_the_other(capsys: pytest.CaptureFixture[str]) -> None:
    be_verbose(True)
    with progress_listener(quiet=False) as listen:
        for stage, share in (("planning", 0.0), ("planning", 0.9), ("checking", 0.1)):
            listen(stage, share)
    be_verbose(False)

    out, err = capsys.readouterr()
    assert out == ""
    assert [re.fullmatch(rf"stages: (\w+){TIME}", line)[1] for line in err.splitlines()] == [
        "reading",
        "planning",
        "checking",
        "all",
    ]


def test_nothing_is_logged_without_the_option(capsys: pytest.CaptureFixture[str]) -> None:
    be_verbose(False)
    with progress_listener(quiet=False) as listen:
        listen("planning", 0.5)

    assert capsys.readouterr() == ("", "")
    assert not STAGES.isEnabledFor(logging.INFO)


def test_a_run_says_how_much_work_it_was(sound: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["verify", str(sound / "run"), "--cell", str(sound / "cell" / "small.yaml")]
    assert run([*command, "-q"]) == 0
    plain = capsys.readouterr()

    assert run([*command, "-v"]) == 0
    verbose = capsys.readouterr()

    assert (verbose.out, plain.err) == (plain.out, "")
    assert re.search(r"^effort: \d+ samples of 9 joints, 45 checks$", verbose.err, re.MULTILINE)
    assert re.search(r"^effort: \d+ nodes in \d+ panels, \d+ sweeps, \d+ linear systems$", verbose.err, re.MULTILINE)
    assert re.search(r"^effort: \d+ pairs, \d+ distance queries, ", verbose.err, re.MULTILINE)
