"""``report.html``: verdict first, nothing from outside, and no name that can break out of its place."""

import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.records import phase_record, whole_record
from jinja2 import DictLoader, Environment, StrictUndefined

from cellplan.model.motion.plan import Phase, Work
from cellplan.model.report.report import Check
from cellplan.model.report.skew import AllowedSkew, PairSkew, SkewLimit, SkewReport
from cellplan.model.robot.repeatability import JointDrift, Repeatability
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.report.page import render
from cellplan.report.page.render import SCRIPTS, CompiledTemplates, report_page
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.run import run_figures

HOSTILE = "\"><img src=x onerror='alert(1)'><script>alert(2)</script>{{ 7*7 }}&amp;"
VOID = {"meta", "br", "img", "link", "hr", "input"}


class Page(HTMLParser):
    """Collects tags, ids and visible text; notes tags that do not match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.wrong: list[str] = []
        self.unfolded_plots = 0
        self.instants: list[float] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if (
            tag == "figure"
            and "details" not in self.open
            and ("class", "plot") in [(n, (v or "")[:4]) for n, v in attrs]
        ):
            self.unfolded_plots += 1
        for name, value in attrs:
            if name == "data-at":
                self.instants.append(float(value or "nan"))
            if name == "id":
                self.ids.append(value or "")
            if name in {"href", "src", "xlink:href"}:
                self.links.append(value or "")
            if name.startswith("on"):
                self.wrong.append(f"{tag} {name}")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}>")

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in {"style", "script"}:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def page_of(run: Any, plots: dict[str, bytes] | None = None) -> str:
    shown = pictures(run_figures(run.report, cell=run.cell)) if plots is None else plots
    record = phase_record(run.report, cell=run.cell, provenance=run.provenance)
    return report_page(record, cell=run.cell, plots=shown)


def overview_of(runs: Any) -> str:
    first = runs["circle"]
    reports = {name: run.report for name, run in runs.items()}
    return report_page(whole_record(reports, cell=first.cell, provenance=first.provenance), cell=first.cell, plots={})


@pytest.fixture(scope="module")
def failed_page(failed_run: Any) -> str:
    return page_of(failed_run)


def test_page_is_whole_and_stands_alone(failed_page: str) -> None:
    page = Page(failed_page)
    assert page.wrong == []
    assert page.open == []
    assert not {"link", "img", "iframe", "object"} & set(page.tags)
    assert [link for link in page.links if not link.startswith(("#", "view.html"))] == [
        *("report.json", "series.json", "cell.yaml", "manifest.json"),
        *(link for link in page.links if link.startswith("plots/")),
    ]
    addresses = set(re.findall(r"https?://[^\"' ]+", failed_page))
    assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}, "only names of XML languages"
    assert "@import" not in failed_page
    assert "@font-face" not in failed_page


def test_names_of_drawn_parts_do_not_clash(failed_page: str) -> None:
    page = Page(failed_page)
    assert len(page.ids) == len(set(page.ids))
    assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", failed_page)) <= set(page.ids)


def test_verdict_comes_first_in_plain_words(failed_run: Any, failed_page: str) -> None:
    text = Page(failed_page).text
    verdict = text.index("✗ FAILED 3 of 28 checks failed")
    assert verdict < text.index("Cycle time") < text.index("Verification")
    for check in failed_run.report.checks:
        if not check.passed:
            assert check.message in text


def test_passed_run_says_so(passed_run: Any) -> None:
    text = Page(page_of(passed_run, plots={})).text
    assert "✓ PASSED All 27 checks passed." in text
    assert "FAILED" not in text


def test_key_figures_name_the_worst_and_its_instant(passed_run: Any) -> None:
    text = Page(page_of(passed_run, plots={})).text
    assert "Cycle time 4 s 4001 samples, 1 ms apart" in text
    assert "Smallest clearance 41.0 mm staubli/C3 and staubli/C6 at 3.060 s; required 5 mm" in text
    worst = min(passed_run.report.joints, key=lambda use: use.margin)
    assert re.search(
        rf"Smallest joint margin [\d.]+ deg {worst.robot} {worst.joint} at {worst.margin_at_s:.3f} s", text
    )


def test_caution_and_assumptions_are_printed(failed_page: str) -> None:
    text = Page(failed_page).text
    assert (
        "Offline result: run first at reduced speed; not a safety function; "
        "the risk assessment stays with the integrator." in text
    )
    assert "Joints move linearly between samples; the samples are 1 ms apart." in text
    assert "certified at all times, also between the samples, provided that every joint moves linearly" in text
    assert "took 349 distance queries and 348 contact queries" in text
    assert "calibration errors and elasticity (here 5 mm)" in text
    assert "@media print" in failed_page


def test_drawings_have_a_text_for_those_who_cannot_see_them(failed_page: str) -> None:
    figures = re.findall(r'<figure class="plot[^>]*>', failed_page)
    assert len(figures) == 3 + 4 + 4 + 4  # tasks, positions, velocities; margins, speeds, clearance and singularity
    assert all('role="img"' in figure and 'aria-label="' in figure for figure in figures)


def test_missing_values_are_dashes(rail_run: Any) -> None:
    text = Page(page_of(rail_run)).text
    assert "no such pair" in text
    assert "no limits" in text
    assert not re.search(r"\b(None|nan|inf)\b", text)
    assert not re.search(r"\d[eE][-+]\d", text)


def test_figures_are_never_rounded_to_the_better_side(passed_run: Any) -> None:
    clearance = passed_run.report.clearance
    minima = {kind: replace(minimum, minimum=0.00499) for kind, minimum in clearance.minima.items()}
    joints = (replace(passed_run.report.joints[0], margin=-1e-5), *passed_run.report.joints[1:])
    report = replace(passed_run.report, clearance=replace(clearance, minima=minima), joints=joints)
    text = Page(page_of(replace(passed_run, report=report), plots={})).text
    assert "Smallest clearance ✗ 4.9 mm" in text
    assert "outside by 0.000573" in text  # 1e-5 rad in degrees


def test_a_broken_sliding_joint_is_the_smallest_margin_while_turning_joints_hold(rail_run: Any) -> None:
    joints = (replace(rail_run.report.joints[0], margin=-0.04626), *rail_run.report.joints[1:])
    broken = replace(rail_run, report=replace(rail_run.report, joints=joints))

    text = Page(page_of(broken, plots={})).text

    assert f"Smallest joint margin ✗ −46.3 mm {joints[0].robot} {joints[0].joint} at" in text


def hostile(run: Any) -> Any:
    """The same run with names that try to become markup."""
    robots = (replace(run.cell.robots[0], name=HOSTILE), *run.cell.robots[1:])
    renamed = {"reis": HOSTILE}
    report = run.report
    check = Check(
        name="payload", subject=HOSTILE, passed=False, value=1.0, limit=0.0, unit="mm", at_s=None, message=HOSTILE
    )
    report = replace(
        report,
        cell=HOSTILE,
        mode=HOSTILE,
        checks=(check,),
        joints=tuple(
            replace(u, robot=HOSTILE, joint=f"{u.joint}$x_{{$<&") if u.robot == "reis" else u for u in report.joints
        ),
        q={renamed.get(name, name): values for name, values in report.q.items()},
        qd={renamed.get(name, name): values for name, values in report.qd.items()},
        motion_share={renamed.get(name, name): share for name, share in report.motion_share.items()},
        speeds={renamed.get(name, name): replace(speed, axis=HOSTILE) for name, speed in report.speeds.items()},
        clearance=replace(report.clearance, exclusions=((HOSTILE, HOSTILE, HOSTILE),)),
    )
    report = replace(
        report,
        accuracy=tuple(
            replace(accuracy, task=HOSTILE) if accuracy.task == "circle" else accuracy for accuracy in report.accuracy
        ),
        phases=(Phase(name=HOSTILE, roles={HOSTILE: Work(HOSTILE)}, end=4.0),),
    )
    tasks = tuple(replace(task, name=HOSTILE) if task.name == "circle" else task for task in run.cell.tasks)
    cell = replace(run.cell, robots=robots, tasks=tasks, inputs={HOSTILE: HOSTILE})
    return replace(run, report=report, cell=cell)


def test_hostile_names_stay_text(passed_run: Any) -> None:
    text = page_of(hostile(passed_run))
    page = Page(text)
    assert page.wrong == []
    assert page.open == []
    assert "img" not in page.tags
    assert page.tags.count("script") == len(SCRIPTS)
    assert HOSTILE in "".join(page.words)
    assert page.text.count(HOSTILE) > 20  # the cell, robots, tasks, phases, checks, pairs and files
    assert "49" not in page.text.partition("checks")[0]


def test_overview_leads_to_the_report_of_every_run(pairwise_runs: Any) -> None:
    page = Page(overview_of(pairwise_runs))
    assert page.wrong == []
    assert [link for link in page.links if link.endswith("report.html")] == [
        "circle/report.html",
        "rhombus/report.html",
        "rectangle/report.html",
    ]
    assert "3 of 82 checks failed" in page.text
    assert "rhombus : kuka/B5 and abb/A5 collide" in page.text
    assert "Cycle time 12 s 3 runs, one after another" in page.text


def test_links_of_an_overview_lead_to_parts_of_it(pairwise_runs: Any) -> None:
    limits = (AllowedSkew(limit=SkewLimit.CLEARANCE, skew=0.01, subject="kuka and abb", at_s=1.0),)
    skew = SkewReport(pairs=(PairSkew(first="kuka", second="abb", limits=limits, stated=0.02),), tools=(), groups=())
    runs = {name: replace(run, report=replace(run.report, skew=skew)) for name, run in pairwise_runs.items()}

    page = Page(overview_of(runs))

    assert page.wrong == []
    assert "#skew" in page.links
    assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)


def test_same_run_gives_the_same_page(failed_run: Any, failed_page: str, pairwise_runs: Any) -> None:
    assert page_of(failed_run) == failed_page
    assert overview_of(pairwise_runs) == overview_of(pairwise_runs)


def test_joints_that_do_not_come_back_have_a_table(passed_run: Any) -> None:
    drift = JointDrift(
        robot="kuka", joint="B2", is_revolute=True, drift=np.array([0.01, -0.02]), worst=0.02, at_cycle=2
    )
    result = Repeatability(cycle_times=np.array([0.0, 1.0, 2.0]), drifts=(drift,), closes=False)
    run = replace(passed_run, report=replace(passed_run.report, repeatability=result))

    text = page_of(run)

    assert "The joints do not return" in text
    assert "after each of the 2 cycles of 1 s" in text
    assert "1.15 deg" in text
    assert "Repeatability" not in page_of(passed_run)


def test_a_smoothed_path_has_its_roughness_with_the_bound_and_its_error(passed_run: Any) -> None:
    record = phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance)
    points = {"given": 3.25, "smoothed": 2.125, "bound": 2.0625}
    error = {"position_mm": 0.2, "max_position_error_mm": 0.1875, "max_position_error_at_s": 1.5}
    name = next(iter(record["tasks"]))
    record["tasks"][name]["smoothing"] = {"points": points, "axes": None, **error}

    text = Page(report_page(record, cell=passed_run.cell, plots={})).text

    assert f"{name} points, 1/m 3.25 2.12 2.06 0.2 mm 0.188 mm 1.500" in text


def test_a_failed_joint_is_reported_in_plain_words(passed_run: Any) -> None:
    locked = (LockedJointEntry(robot="kuka", joint="B2", from_s=2.0),)
    cell = replace(passed_run.cell, motion=replace(passed_run.cell.motion, locked=locked))

    record = phase_record(passed_run.report, cell=cell, provenance=passed_run.provenance)
    page = Page(report_page(record, cell=cell, plots={})).text

    assert "Joint kuka/B2 fails at 2.000 s and stays at " in page
    assert "the other joints compensate, and every task stays within its tolerance." in page


def test_with_many_robots_pictures_are_folded_and_each_robot_has_a_line(
    passed_run: Any, failed_run: Any, rail_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(render, "MAX_UNFOLDED", 3)
    for run in (passed_run, failed_run, rail_run):
        page = Page(page_of(run))
        assert page.wrong == []
        assert page.open == []
        assert len(page.ids) == len(set(page.ids))
        assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)
        assert page.tags.count("details") == page.tags.count("summary")
        assert page.unfolded_plots <= 3  # margins, speeds and clearance
        assert "Smallest margin and highest speed of each robot; details follow" in page.text
        assert {f"joints-{robot}" for robot in run.report.q} <= set(page.ids)


def test_with_few_robots_only_joint_curves_are_folded(passed_run: Any) -> None:
    assert Page(page_of(passed_run)).unfolded_plots == 3 + 4  # tasks; margins, speeds, clearance and singularity


def test_the_line_of_a_robot_names_its_worst_joints(failed_run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render, "MAX_UNFOLDED", 3)
    text = Page(page_of(failed_run, plots={})).text
    overview = text[text.index("Smallest margin and highest speed of each robot") :]

    for robot in failed_run.report.q:
        uses = [use for use in failed_run.report.joints if use.robot == robot]
        near = min(uses, key=lambda use: use.margin / (use.upper - use.lower))
        fast = max(uses, key=lambda use: use.peak_velocity / use.velocity_limit)
        line = overview[overview.index(f" {robot} ") :].split(" % ", 1)[0]
        assert line.split()[:2] == [robot, near.joint]
        assert fast.joint in line
        assert ("outside by" in line) == (near.margin < 0.0)


@pytest.fixture(autouse=True)
def written_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python keeps what it compiles in a folder of the test."""
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)


def shown(text: str, trim: bool = False) -> str:
    """What a process that has compiled nothing yet makes of a template named page.html."""
    environment = Environment(
        loader=DictLoader({"page.html": text}), autoescape=True, undefined=StrictUndefined, trim_blocks=trim
    )
    environment.bytecode_cache = CompiledTemplates(environment)
    return environment.get_template("page.html").render(name="<b>")


def entries(folder: Path) -> list[Path]:
    """What is kept."""
    return sorted(folder.rglob("*.template"))


def test_a_template_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = shown("Hello {{ name }}")
    monkeypatch.setattr(Environment, "compile", lambda *_: pytest.fail("compiled again"))

    assert first == shown("Hello {{ name }}") == "Hello &lt;b&gt;"
    assert len(entries(tmp_path)) == 1


def test_a_changed_template_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    assert [shown("one"), shown("two"), shown("two")] == ["one", "two", "two"]
    assert len(entries(tmp_path)) == 1


def test_other_options_are_other_templates() -> None:
    text = "{% if name %}\nyes{% endif %}"

    assert [shown(text, trim=trim) for trim in (False, True, False)] == ["\nyes", "yes", "\nyes"]


@pytest.mark.parametrize("length", [0, 10, 40, 200])
def test_a_damaged_file_is_made_again(length: int, tmp_path: Path) -> None:
    shown("Hello {{ name }}")
    (file,) = entries(tmp_path)
    whole = file.read_bytes()
    file.write_bytes(whole[:length])

    assert shown("Hello {{ name }}") == "Hello &lt;b&gt;"
    assert file.read_bytes() == whole


def test_nothing_is_written_where_python_may_not_or_cannot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert shown("text") == "text"
    assert not entries(tmp_path)

    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path / "file"))
    assert shown("text") == "text"
