"""What is said of everything that was not judged in full."""

from cellplan.model.report.left_out import left_out_lines


def test_there_is_one_line_for_each_kind_with_bodies_and_reasons() -> None:
    reported = [
        ("grip", ("a/hand", "part"), "holds the part"),
        ("excluded", ("a/hand", "post"), "a cover"),
        ("grip", ("a/tool", "part"), "holds the part"),
        ("excluded", ("b/hand", "post"), "another cover"),
    ]

    assert left_out_lines(reported) == [
        "not checked in full, excluded by the cell: a/hand - post (a cover); b/hand - post (another cover)",
        "not checked in full, grip: a/hand - part, a/tool - part (holds the part)",
    ]


def test_many_pairs_of_one_reason_are_counted() -> None:
    reported = [("standing", (f"r{k}/foot", "floor"), "they stand") for k in range(5)]

    (line,) = left_out_lines(reported)

    assert line.endswith("r0/foot - floor, r1/foot - floor, r2/foot - floor and 2 more (they stand)")


def test_nothing_left_out_is_said_in_words() -> None:
    assert left_out_lines([]) == ["every pair was checked in full"]
