"""A program format of your own: one JSON file per robot, read back and verified before it is written.

A format is an entry of ``EXPORTERS``: a function that renders a verified run, an independent reader of the text,
and the number of decimals. ``export_program`` makes every check again on what the reader returns.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from cellplan import export_program, load_cell, open_gate, solve, write_run
from cellplan.pipeline.export import EXPORTERS, Exporter

CELL = Path(__file__).resolve().parent / "plate.yaml"
RUN, PROGRAMS = Path("outputs/examples/run"), Path("outputs/examples/json")
DECIMALS = 9  # of a second, and of a degree: this example is for revolute joints


def render(run):
    """One file per robot: times in [s] and joint positions in [deg], a list per sample."""
    (motion,) = run.motions
    return {f"{name}.json": json.dumps(rows(table)) for name, table in motion.tables.items()}


def rows(table):
    """Time and joint positions of each sample, rounded."""
    return np.column_stack([table.times, np.rad2deg(table.q)]).round(DECIMALS).tolist()


def read(run, files):
    """The joint tables that the files hold."""
    (motion,) = run.motions
    tables = {}
    for name, table in motion.tables.items():
        numbers = np.array(json.loads(files[f"{name}.json"]))
        tables[name] = replace(table, times=numbers[:, 0].copy(), q=np.deg2rad(numbers[:, 1:]))
    return (tables,)


EXPORTERS["json"] = Exporter(render=render, read=read, decimals=DECIMALS)
cell = load_cell(CELL)
write_run(solve(cell), RUN)
print("written:", *export_program(open_gate(RUN), PROGRAMS, form="json"))
