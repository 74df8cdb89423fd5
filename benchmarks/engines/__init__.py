"""Engines: who can resolve the reference job.

Each module beside this file has one function ``prepare(job, **options)``. It builds all that can be built beforehand;
what it gives back is called once per run, timed, and gives the joint positions at every instant, shape (N, nq).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """Who resolves the job.

    Attributes:
        name: What it is called in tables.
        module: The module of this package that drives it.
        group: Its dependency group in pyproject.toml, which is also the name of its folder under ``.venv-bench``;
            empty for cellplan itself.
        package: The distribution whose version stands beside its name.
        choices: What it is and what was chosen for it, for the page.
        options: Options of its module besides the job.
        every: It is given every so many samples only; those between lie on a cubic through the four nearest.
        looks: How many steps it may take to each.
        goal_s: Processor time in [s] that it is to stay within.
        goal_m: Largest error between the samples in [m] that it is to stay within.
    """

    name: str
    module: str
    group: str = ""
    package: str = "cellplan"
    choices: str
    options: Mapping[str, float] = field(default_factory=dict)
    every: int = 1
    looks: int = 1
    goal_s: float | None = None
    goal_m: float | None = None


CELLPLAN = (
    Engine(
        name="cellplan, to 0.001 mm",
        module="by_cellplan",
        options={"accuracy_m": 1e-6},
        choices="its accurate mode: nodes as the error between them demands, sampled at the end; the error at every "
        "sample, 15 ms more in a solve, is left out",
        goal_s=0.050,
        goal_m=1e-6,
    ),
    Engine(
        name="cellplan, to 0.0001 mm",
        module="by_cellplan",
        options={"accuracy_m": 1e-7},
        choices="the same with the default of `solver.accuracy_mm`",
    ),
    Engine(
        name="cellplan, to 0.000001 mm",
        module="by_cellplan",
        options={"accuracy_m": 1e-9},
        choices="the same with finer nodes",
        goal_s=0.250,
        goal_m=1e-9,
    ),
    Engine(
        name="cellplan, Euler steps",
        module="by_cellplan_euler",
        choices="Eq. 5.1 of the thesis: Jacobian, weighted pseudo-inverse and error feedback, one step per sample",
    ),
)
PEERS = (
    Engine(
        name="Pink",
        module="by_pink",
        group="bench-pink",
        package="pin-pink",
        choices="a `RelativeFrameTask` per tool on one pinocchio model, tasks as constraints, DAQP, no limits",
    ),
    Engine(
        name="mink",
        module="by_mink",
        group="bench-mink",
        package="mink",
        choices="a `RelativeFrameTask` per tool on one MuJoCo model, tasks as constraints, DAQP, no limits",
    ),
    Engine(
        name="Robotics Toolbox",
        module="by_toolbox",
        group="bench-toolbox",
        package="roboticstoolbox-python",
        choices="kinematics and Jacobians of the compiled chains; relative tasks and their solution in NumPy",
    ),
    Engine(
        name="EmbodiK",
        module="by_embodik",
        group="bench-embodik",
        package="embodik",
        choices="a relative frame task per tool, its velocity solver in C++ without limits and damping",
    ),
    Engine(
        name="PlaCo",
        module="by_placo",
        group="bench-placo",
        package="placo",
        choices="a relative frame task per tool, its solver in C++ without limits",
    ),
)
SPARING = tuple(
    replace(
        peer,
        name=f"{peer.name}, every 10th sample",
        choices="two steps to every 10th sample; the cubic through the four nearest in between, at no cost",
        every=10,
        looks=2,
    )
    for peer in PEERS
    if peer.name in {"Pink", "mink", "PlaCo"}
)
ENGINES = CELLPLAN + PEERS + SPARING
