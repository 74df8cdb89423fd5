"""A robot of a cell from a xacro file: arguments, packages, digests of all files that were read, remarks."""

from collections.abc import Callable
from pathlib import Path

import pytest
from builders.xacro_texts import write_arm

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell

MODEL = "model: arm.urdf.xacro\n    package_dirs: [packages]"
PLAIN = ("    weights: [1, 1, 1, 1, 1, 1]\n", "")
Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]


def test_arguments_reach_the_file_and_all_that_was_read_has_a_digest(load: Load) -> None:
    write_arm(Path.cwd())
    arguments = 'xacro_args: {prefix: "", length: 0.7}'

    cell = load(("model: abb_irb1600", f"{MODEL}\n    {arguments}"), PLAIN)
    read = {"arm.urdf.xacro", "packages/arm_support/urdf/segment.xacro", "sizes.yaml"}

    assert cell.robot("worker").model.joint_names == ("upper_joint", "lower_joint")
    assert set(cell.inputs) == {"bundled:kuka_kr6", "c", *read}
    assert cell.remarks == (
        (
            "robots.worker.model",
            "segment.xacro:6: joint 'upper_joint': attribute 'damping' of <limit> is not known and was not read "
            "(and 1 more)",
        ),
        ("robots.worker.model", "arm.urdf.xacro: known, but not used: effort of <limit>"),
    )
    sizes = Path("sizes.yaml")
    sizes.write_text(sizes.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    again = load_cell("c")
    assert {name for name in read if cell.inputs[name] != again.inputs[name]} == {"sizes.yaml"}


def test_the_written_cell_reads_back_with_its_arguments(load: Load) -> None:
    write_arm(Path.cwd())
    written = render_cell(load(("model: abb_irb1600", f"{MODEL}\n    xacro_args: {{prefix: '', length: 1}}"), PLAIN))
    Path("copy").write_text(written, encoding="utf-8")

    assert render_cell(load_cell("copy")) == written


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (
            f"{MODEL}\n    xacro_args: {{lenght: 1}}",
            "arm.urdf.xacro: xacro_args: unknown argument 'lenght', did you mean 'length'?",
        ),
        (
            f"{MODEL}\n    xacro_args: {{length: [1]}}",
            "c:10: robots.worker.xacro_args.length: expected a text, a number, true or false, got a list of 1",
        ),
        (
            "model: arm.urdf\n    xacro_args: {length: 1}",
            "c:9: robots.worker.xacro_args: unexpected key, it applies to a file whose name ends in .xacro only",
        ),
        (
            "model: abb_irb1600\n    xacro_args: {length: 1}",
            "c:9: robots.worker.xacro_args: unexpected key, it applies to a URDF only",
        ),
        (
            "model: arm.urdf.xacro",
            "arm.urdf.xacro:4: no package 'arm_support', looked through {folder}: name the folder that holds it in "
            "`package_dirs`",
        ),
        (
            f"{MODEL}\n    xacro_args: {{length: ../../x}}",
            "segment.xacro:8: link 'left_upper': expected 3 finite numbers in 'size', got '0.1 0.1 ../../x'",
        ),
    ],
)
def test_findings_about_xacro_robots(load: Load, refuse: Refuse, model: str, message: str) -> None:
    path = write_arm(Path.cwd())
    path.with_name("arm.urdf").write_text('<robot name="r"><link name="b"/></robot>', encoding="utf-8")

    message = message.replace("{folder}", str(Path.cwd()))
    assert message in refuse(("model: abb_irb1600", model), PLAIN)


def test_a_xacro_file_that_fills_the_memory_ends_with_one_line(load: Load, refuse: Refuse) -> None:
    text = '<robot name="r" xmlns:xacro="x"><link name="${\'x\' * 10**10}"/></robot>'
    Path("bomb.xacro").write_text(text, encoding="utf-8")

    reported = refuse(("model: abb_irb1600", "model: bomb.xacro"), PLAIN)

    assert "bomb.xacro: the URDF reader needed more than 1500 MB" in reported
