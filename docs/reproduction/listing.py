"""Every numbered figure and table of the three publications, each once, with its verdict and where it stands here."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from reproduction import pages
from reproduction.pages import ALGORITHM, FIGURE, PAGES, TABLE

REPRODUCED = "reproduced"
DIFFERS = "differs"
CHOSEN = "chosen"
CIRCULAR = "circular"
USED = "used"
NOT_ATTEMPTED = "not attempted"

PICTURE = "an illustration without a result"
OTHERS = "the literature, not a result of the thesis"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One numbered item of a publication, or several in a row that say the same of different things.

    Attributes:
        kind: Figure, table or algorithm.
        numbers: The numbers as printed, in order.
        shows: What it shows, in our words.
        verdict: What became of it.
        where: Where on this page or in the program it stands; why, where it differs or was not attempted.
    """

    kind: str
    numbers: tuple[str, ...]
    shows: str
    verdict: str
    where: str

    def text(self, paper: str) -> str:
        """The line in Markdown, with the pages on which the items stand."""
        named = f"{self.kind} {_span(self.numbers)}"
        on = _span(tuple(str(PAGES[paper][self.kind][number]) for number in self.numbers))
        return f"| {named} | {on} | {self.shows} | {self.verdict} | {self.where} |"


def _span(numbers: Sequence[str]) -> str:
    """The first and the last of several numbers."""
    first, last = numbers[0], numbers[-1]
    return first if first == last else f"{first} to {last}"


def entry(kind: str, numbers: str, shows: str, verdict: str, where: str) -> Entry:
    """An entry from a number (``4.1``) or a range of numbers with the same prefix (``5.1-5.4``)."""
    first, _, last = numbers.partition("-")
    prefix, _, low = first.rpartition(".")
    high = last.rpartition(".")[2] or low
    dotted = f"{prefix}." if prefix else ""
    named = tuple(f"{dotted}{number}" for number in range(int(low), int(high) + 1))
    return Entry(kind=kind, numbers=named, shows=shows, verdict=verdict, where=where)


CASE = "case {} above"
VARGAS = (
    entry(FIGURE, "1", "block diagram of the closed loop", USED, "the loop of all methods here; " + PICTURE),
    entry(FIGURE, "2", "plane of k and theta of the scalar filter", REPRODUCED, "scalar filter above"),
    entry(FIGURE, "3", "the planar arm", USED, "`cells/papers/robots/vargas_3r.yaml`"),
    entry(FIGURE, "4", "case I: desired path and arm", REPRODUCED, CASE.format("I")),
    entry(FIGURE, "5", "case I: paths", REPRODUCED, CASE.format("I")),
    entry(FIGURE, "6", "case I: error", REPRODUCED, CASE.format("I")),
    entry(FIGURE, "7", "case I: conditioning", REPRODUCED, CASE.format("I")),
    entry(FIGURE, "8-11", "case II: paths, paths enlarged, error, conditioning", REPRODUCED, CASE.format("II")),
    entry(FIGURE, "12", "case III: paths", REPRODUCED, CASE.format("III")),
    entry(
        FIGURE,
        "13",
        "case III: paths enlarged",
        DIFFERS,
        "case III above: the path turns less with law II, but its joints move faster than with law I",
    ),
    entry(FIGURE, "14-15", "case III: error and conditioning", REPRODUCED, CASE.format("III")),
)

STAND = "the stand of the thesis and its electronics, not a result"
HARDWARE = "needs the prototype arm; its kinematic part is above"
NICOLATO = (
    entry(FIGURE, "2.1", "pinhole model of a camera", USED, "camera above"),
    entry(FIGURE, "3.1", "what one joint adds to the position", USED, "method `heuristic_search`; " + PICTURE),
    entry(
        FIGURE,
        "3.2",
        "brake near a limit of position",
        USED,
        "`brakes` of `recursive_search`, there towards a limit only",
    ),
    entry(FIGURE, "3.3", "arm with nominal and with real links", USED, "camera above; " + PICTURE),
    entry(FIGURE, "3.4", "block diagram with an external sensor", USED, "camera above, and the simulated arm above"),
    entry(ALGORITHM, "1", "best-first search", DIFFERS, "circle above: as printed it jumps from joint to joint"),
    entry(TABLE, "4.1", "Denavit-Hartenberg parameters of the 3R arm", USED, "`nicolato_3r.yaml`"),
    entry(
        FIGURE,
        "4.1",
        "circle by search",
        DIFFERS,
        "circle above: smooth with momentum, not as printed; the printed error is the stopping rule here",
    ),
    entry(FIGURE, "4.2", "circle by damped least squares", REPRODUCED, "circle above; the onset of damping is chosen"),
    entry(FIGURE, "4.3", "line of singular points", DIFFERS, "line above: smooth with momentum, not as printed"),
    entry(FIGURE, "4.4-4.5", "limits of the fourth joint", REPRODUCED, "limits above"),
    entry(FIGURE, "4.6", "ellipse by pseudo-inverse", REPRODUCED, "ellipse above"),
    entry(FIGURE, "4.7", "ellipse by recursive search", REPRODUCED, "ellipse above: from the second cycle on"),
    entry(TABLE, "4.2", "Denavit-Hartenberg parameters of the PUMA type", USED, "`nicolato_puma.yaml`"),
    entry(FIGURE, "4.8", "position and orientation", CIRCULAR, "pose above: its errors are the stopping rule"),
    entry(
        TABLE,
        "4.3",
        "lengths, masses and friction of the simulated arm",
        USED,
        "`nicolato_planar.yaml`, `nicolato_servo.yaml`: the simulated arm above",
    ),
    entry(
        FIGURE,
        "4.9",
        "block diagram of the visual control",
        USED,
        "the simulated arm above; the place of the backlash is not in the text",
    ),
    entry(TABLE, "4.4", "gains of the joint controllers", USED, "the simulated arm above"),
    entry(
        FIGURE,
        "4.10-4.11",
        "path in the image, error and joints",
        CHOSEN,
        "the simulated arm above: the height of the camera and the share of each correction were chosen",
    ),
    entry(FIGURE, "5.1-5.2", "experimental stand and its software", NOT_ATTEMPTED, STAND),
    entry(FIGURE, "5.3-5.4", "colour classification, vision system", NOT_ATTEMPTED, STAND),
    entry(FIGURE, "5.5-5.6", "a point from a singular start: path and error", NOT_ATTEMPTED, HARDWARE),
    entry(
        FIGURE,
        "5.7",
        "the same: solution of the search",
        CHOSEN,
        "planar arm above: the order of the joints was chosen",
    ),
    entry(FIGURE, "5.8", "the same: joints", NOT_ATTEMPTED, HARDWARE),
    entry(FIGURE, "5.9", "the same with a weight on the first joint: path", NOT_ATTEMPTED, HARDWARE),
    entry(FIGURE, "5.10", "the same: joints", DIFFERS, "planar arm above: the third joint moves less, not more"),
    entry(FIGURE, "5.11-5.12", "circles: path and error", NOT_ATTEMPTED, HARDWARE),
    entry(FIGURE, "5.13", "circles: joints come back", REPRODUCED, "planar arm above"),
    entry(TABLE, "5.1", "gains of the joint controllers", NOT_ATTEMPTED, STAND),
    entry(FIGURE, "5.14", "pictures of the arm at start and end", NOT_ATTEMPTED, STAND),
    entry(FIGURE, "5.15-5.18", "visual control: image, references, joints", NOT_ATTEMPTED, HARDWARE),
    entry(FIGURE, "A.1-A.4", "photographs of arm, motors and boards", NOT_ATTEMPTED, STAND),
    entry(FIGURE, "A.5", "frames of the prototype", USED, "planar arm above"),
    entry(TABLE, "A.1", "Denavit-Hartenberg parameters of the prototype", USED, "planar arm above"),
)

MODE = "distribution of work above, by joint; curves depend on the layout, which is ours"
SIZE = "largest position errors above: the gain was chosen for their size"
PARTS = "components above: no number of them is in the text, and the gain was chosen for the size"
ROBOT = "bundled robot; the limits and screws of the table"
RIBEIRO = (
    entry(FIGURE, "1", "what goes into the model and comes out", NOT_ATTEMPTED, PICTURE),
    entry(TABLE, "1", "uses of the cooperation Jacobian", NOT_ATTEMPTED, "a list of questions, not a result"),
    entry(FIGURE, "2-6", "classifications of systems of several robots", NOT_ATTEMPTED, OTHERS),
    entry(TABLE, "2", "kinds of cooperation", NOT_ATTEMPTED, OTHERS),
    entry(FIGURE, "7-8", "advantages and disadvantages of cooperation", NOT_ATTEMPTED, OTHERS),
    entry(FIGURE, "9-12", "cooperating robots of four makers", NOT_ATTEMPTED, OTHERS),
    entry(FIGURE, "13-14", "chain of two robots, names of its joints", USED, "the model of every cell; " + PICTURE),
    entry(FIGURE, "15-16", "virtual chain of two robots and its graph", USED, "`cellplan explain`, three Jacobians"),
    entry(FIGURE, "17-19", "tools and chain of n robots, names of its joints", USED, "the model of every cell"),
    entry(FIGURE, "20-21", "virtual chains of n robots and their graph", USED, "`cellplan explain`, three Jacobians"),
    entry(FIGURE, "22-23", "design method and block diagram", USED, "`cellplan solve` follows it; " + PICTURE),
    entry(FIGURE, "24", "the part", USED, "`ribeiro_mode_1.yaml`: cylinder of 250 and 500 mm"),
    entry(TABLE, "3", "tasks and robots", USED, "`ribeiro_mode_1.yaml`"),
    entry(TABLE, "4", "REIS RV20-16", USED, ROBOT),
    entry(TABLE, "5", "KUKA KR6", USED, ROBOT),
    entry(TABLE, "6", "ABB IRB 1600", USED, ROBOT),
    entry(TABLE, "7", "STAUBLI RX90L", DIFFERS, "axes of D4 and F4: (0; 0; 1) as of the real arm, not (1; 0; 0)"),
    entry(FIGURE, "25-29", "the robots, the grasp and the robots of each task", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "30", "first layout", NOT_ATTEMPTED, "numbers are not in the text; ours: `ribeiro_first_layout`"),
    entry(FIGURE, "31", "block diagram for four robots", USED, "`cellplan solve`; " + PICTURE),
    entry(FIGURE, "32-33", "first layout: KUKA and STAUBLI beyond a limit", CHOSEN, "first layout above"),
    entry(FIGURE, "34", "first layout: how far KUKA B2 goes", DIFFERS, "first layout above: the layout is ours"),
    entry(FIGURE, "35", "first layout: REIS touches the floor", DIFFERS, "first layout above: ours is on a plinth"),
    entry(FIGURE, "36", "final layout", NOT_ATTEMPTED, "numbers are not in the text; ours: `ribeiro_mode_1`"),
    entry(FIGURE, "37-39", "mode 1: position errors", CHOSEN, SIZE),
    entry(FIGURE, "40-42", "mode 1: components of the errors", CHOSEN, PARTS),
    entry(FIGURE, "43-44", "mode 1: REIS, positions and speeds", DIFFERS, MODE),
    entry(FIGURE, "45-46", "mode 1: KUKA, positions and speeds", DIFFERS, MODE),
    entry(FIGURE, "47-48", "mode 1: ABB, positions and speeds", DIFFERS, MODE),
    entry(FIGURE, "49-50", "mode 1: STAUBLI, positions and speeds", DIFFERS, MODE),
    entry(FIGURE, "51-53", "mode 2: position errors", CHOSEN, SIZE),
    entry(FIGURE, "54", "mode 2, circle: components of the errors", CHOSEN, PARTS),
    entry(FIGURE, "55-58", "mode 2, circle: REIS and KUKA", DIFFERS, MODE),
    entry(FIGURE, "59", "mode 2, rhombus: components of the errors", CHOSEN, PARTS),
    entry(FIGURE, "60-63", "mode 2, rhombus: REIS and ABB", DIFFERS, MODE),
    entry(FIGURE, "64", "mode 2, rectangle: components of the errors", CHOSEN, PARTS),
    entry(FIGURE, "65-68", "mode 2, rectangle: REIS and STAUBLI", DIFFERS, MODE),
    entry(FIGURE, "69-70", "mode 3: position errors of circle and rhombus", CHOSEN, SIZE),
    entry(FIGURE, "71", "mode 3: position error of the rectangle", DIFFERS, "18 times as large in our layout"),
    entry(FIGURE, "72-73", "mode 3: KUKA, positions and speeds", DIFFERS, MODE),
    entry(FIGURE, "74-75", "mode 3: ABB, positions and speeds", DIFFERS, MODE),
    entry(
        FIGURE,
        "76",
        "mode 3: STAUBLI, positions; D4 and F4 beyond their limits",
        DIFFERS,
        "distribution of work above: both pass a limit, but each the other one",
    ),
    entry(FIGURE, "77", "mode 3: STAUBLI, speeds; D4 and F4 too fast", REPRODUCED, "distribution of work above"),
    entry(FIGURE, "78-85", "frames, rotations, Denavit-Hartenberg, velocities", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "86-92", "screws and their displacements", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "93-94", "virtual chains in the plane and in space", USED, "`cellplan explain`; " + PICTURE),
    entry(FIGURE, "95-96", "edges and vertices of a graph", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "97-99", "planar arm with its virtual chain, and its graphs", USED, "Appendices C and D above"),
    entry(FIGURE, "100", "error of Euler's method without feedback", REPRODUCED, "Appendices C and D above"),
    entry(FIGURE, "101", "block diagram with feedback", USED, "Appendices C and D above"),
    entry(FIGURE, "102", "errors in 40 s and gain", CHOSEN, "Appendices C and D above: no number of it is in the text"),
    entry(FIGURE, "103", "the arm at four times", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "104", "null space of a Jacobian", NOT_ATTEMPTED, PICTURE),
    entry(FIGURE, "105-106", "two planar arms, virtual chain and graph", USED, "`ribeiro_appendix_e.yaml`"),
    entry(FIGURE, "107", "error of two arms without feedback", REPRODUCED, "Appendix E above: E.15 against E.16"),
    entry(FIGURE, "108-109", "joints of the two arms", DIFFERS, "Appendix E above: dimensions and path are ours"),
    entry(FIGURE, "110", "errors of the two arms", REPRODUCED, "Appendix E above"),
    entry(FIGURE, "111", "the two arms at four times", NOT_ATTEMPTED, PICTURE),
)

LISTS = {pages.VARGAS: VARGAS, pages.NICOLATO: NICOLATO, pages.RIBEIRO: RIBEIRO}
HEAD = "| item | page | shows | verdict | where, or why not |\n|---|---|---|---|---|"


def listing() -> str:
    """The three tables in Markdown, with the count of every verdict."""
    return "\n\n".join(
        f"### {paper}\n\n{_counts(entries)}\n\n{_table(paper, entries)}" for paper, entries in LISTS.items()
    )


def _table(paper: str, entries: Sequence[Entry]) -> str:
    """One table."""
    return "\n".join([HEAD, *(entry.text(paper) for entry in entries)])


def _counts(entries: Sequence[Entry]) -> str:
    """How many numbered items have each verdict."""
    verdicts = [entry.verdict for entry in entries for _ in entry.numbers]
    counts = [f"{verdicts.count(name)} {name}" for name in _order() if name in verdicts]
    return f"Of {len(verdicts)} numbered items: {', '.join(counts)}."


def _order() -> Iterator[str]:
    """Verdicts in the order in which they are counted."""
    yield from (REPRODUCED, DIFFERS, CHOSEN, CIRCULAR, USED, NOT_ATTEMPTED)
