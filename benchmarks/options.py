"""Command-line options that the benchmarks share."""

import argparse


def benchmark_options(description: str, *, what: str, rounds: int) -> argparse.Namespace:
    """Options of a benchmark: ``rounds``, at least 1, and ``json``.

    Args:
        description: What the benchmark does.
        what: What is run in every round.
        rounds: Default number of rounds.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--rounds", type=int, default=rounds, help=f"{what}; medians are shown (default: {rounds})")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of the table")
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    return options
