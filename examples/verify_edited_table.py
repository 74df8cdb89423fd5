"""Verify edited joint tables: a joint is moved by hand for a while, and the report states where and by how much."""

from pathlib import Path

from cellplan import load_cell, solve, verify

CELL = Path(__file__).resolve().parent / "plate.yaml"

cell = load_cell(CELL)
solution = solve(cell)
tables = dict(solution.runs[0].program.tables)

lines = tables["right"].splitlines()
first = next(number for number, line in enumerate(lines) if line.startswith("time_s")) + 1
for number in range(first + 50, first + 100):  # 1 s to 2 s
    time, A, *others = lines[number].split(",")
    lines[number] = ",".join([time, str(float(A) + 0.01), *others])  # [deg]
edited = tables | {"right": "\n".join(lines) + "\n"}

print(f"as written: {'passed' if verify(solution.cell, tables).passed else 'failed'}")
for check in verify(solution.cell, edited).checks:
    if not check.passed:
        print(f"edited: {check.message}")
