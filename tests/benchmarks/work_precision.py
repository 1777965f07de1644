"""Error over CPU time of several masters on the same FMUs, with communication steps halved from row to row.

    make bench        # or: python tests/benchmarks/work_precision.py [ROUNDS] [-o FILE.png]

Two cases: the loop of a mass and its PD controller, released from 1 m, and the robot shaken by a sine of 10 Hz. The
error is the largest deviation of the watched output at 50 points of the motion, relative to the largest value there,
from `monolithic`, which solves the same FMUs as one equation to 1e-9. A second reference checks it: a matrix
exponential for the loop, `monolithic_dae` for the robot.

The CPU time is that of all threads for the whole motion by simulated second, without loading and initialization: the
shortest of ROUNDS runs in turn. All run on one processor and record nothing.

The peers have one algorithm, get all, set all, step all, which is our `jacobi_plain`: their outputs must be the same.
The last column is the cost of a peer over that of our cheapest way with no larger error.
"""

import os

# threads of linear algebra spin while they wait, which would count as CPU time
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.linalg
from cases import Case, shaken_robot, two_fmus
from masters import Way, ecos, fmpy_loop, libcosim, ours
from matplotlib import rc_context
from matplotlib.figure import Figure

from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.figures.style import ACCENT, COLOURS, GRID, INK, STYLE, save
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.masters.algorithms import open_master

POINTS = 50
"""Points of the motion at which errors are taken."""

HALVINGS = 7
"""Number of communication steps, each half of the one before."""

PEERS: dict[str, Way] = {"fmpy, by hand": fmpy_loop, "ecos": ecos, "libcosim": libcosim}

ALGORITHMS = ("jacobi_plain", "gauss_seidel", "gauss_seidel_linear", "gauss_seidel_quadratic", "quasi_newton")

WORST = 1.0
"""Largest error of a row that counts: beyond it the steps are unstable or too long to be of use."""


@dataclass(frozen=True)
class Row:
    """A master with one communication step [s]: relative error, and CPU time per simulated second."""

    name: str
    step_size: float
    error: float
    cost: float


def reference(case: Case, duration: float, algorithm: str = "monolithic") -> np.ndarray:
    """Return the watched output at the points of a motion, from the same FMUs as one equation."""
    assembly = Assembly.read(case.system, case.files)
    master = open_master(assembly, algorithm, duration / POINTS, None)
    try:
        master.initialize()
        values = []
        for _ in range(POINTS):
            master.advance(1)
            values.append(master.read([case.watched])[0])
        return np.array(values)
    finally:
        master.close()


def exact_loop(duration: float) -> np.ndarray:
    """Return the position of the mass of `two_fmus` at the points of a motion, by a matrix exponential.

    States: position, velocity, and the filtered position of the controller.
    """
    rate = 1 / 0.02
    a = np.array([[0, 1, 0], [-100 - 40 - 2 * rate, -0.5, 2 * rate], [rate, 0, -rate]])
    times = duration / POINTS * np.arange(1, POINTS + 1)
    return np.array([(scipy.linalg.expm(a * time) @ [1.0, 0.0, 0.0])[0] for time in times])


def measure(case: Case, duration: float, true: np.ndarray, rounds: int) -> list[Row]:
    """Return the rows of all masters, by master from long to short steps."""
    library = stepping_library()
    ways = {**{name: ours(library, algorithm=name) for name in ALGORITHMS}, **PEERS}
    steps = [case.step_size / 2**i for i in range(HALVINGS)]
    runs = {
        (name, step): (way, replace(case, step_size=step), round(duration / step))
        for name, way in ways.items()
        for step in steps
    }
    costs = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for run, (way, stepped, count) in runs.items():
            costs[run] = min(costs[run], way(stepped, count)[0] / duration)
    scale = np.abs(true).max()
    values = {run: way(stepped, count, POINTS)[1] for run, (way, stepped, count) in runs.items()}
    for name, step in values:
        if name in PEERS:
            plain = values["jacobi_plain", step]
            np.testing.assert_allclose(
                values[name, step], plain, rtol=0, atol=1e-9 * scale, err_msg=f"{name}, {step} s"
            )
    return [Row(*run, np.abs(found - true).max() / scale, costs[run]) for run, found in values.items()]


def front(rows: Sequence[Row]) -> list[Row]:
    """Return those of our rows than which no other of ours is both cheaper and more accurate, cheapest first."""
    found: list[Row] = []
    for row in sorted((row for row in rows if row.name not in PEERS and row.error < WORST), key=lambda row: row.cost):
        if not found or row.error < found[-1].error:
            found.append(row)
    return found


def cheapest(rows: Sequence[Row], error: float) -> Row | None:
    """Return our cheapest row whose error is no larger; `None` if all are larger."""
    return next((row for row in front(rows) if row.error <= error * (1 + 1e-6)), None)


def table(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines."""
    lines = [f"{'':24} {'step [us]':>10} {'error':>10} {'CPU [us/s]':>11}  cost over ours at this error"]
    for row in rows:
        line = f"{row.name:24} {row.step_size * 1e6:10.1f} {row.error:10.2e} {row.cost * 1e6:11.1f}"
        if row.name in PEERS and row.error < WORST:
            best = cheapest(rows, row.error)
            line += (
                f"  {row.cost / best.cost:.1f} ({best.name}, {best.step_size * 1e6:g} us)" if best else "  ours: none"
            )
        lines.append(line)
    return lines


def draw(tables: dict[str, Sequence[Row]], file: Path) -> None:
    """Write the figure: one panel per case, error over cost, one line per master."""
    looks = {
        "jacobi_plain": {"color": COLOURS[0], "marker": "o", "linestyle": ":"},
        "gauss_seidel": {"color": COLOURS[0], "marker": "s"},
        "gauss_seidel_linear": {"color": COLOURS[0], "marker": "^"},
        "gauss_seidel_quadratic": {"color": COLOURS[0], "marker": "D"},
        "quasi_newton": {"color": COLOURS[0], "marker": "x"},
        "fmpy, by hand": {"color": COLOURS[4], "marker": "o"},
        "ecos": {"color": COLOURS[1], "marker": "o"},
        "libcosim": {"color": COLOURS[2], "marker": "o"},
    }
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0, 5.2), layout="constrained", dpi=120)
        panels = figure.subplots(1, len(tables), squeeze=False)[0]
        for axes, (title, rows) in zip(panels, tables.items(), strict=True):
            best = front(rows)
            axes.plot([row.cost for row in best], [row.error for row in best], color=ACCENT, linewidth=6, alpha=0.25,
                      label="front of hfsa")  # fmt: skip
            for name, look in looks.items():
                found = [row for row in rows if row.name == name and row.error < WORST]
                label = name if name in PEERS else f"hfsa, {name}"
                axes.plot(
                    [r.cost for r in found], [r.error for r in found], label=label, markersize=5, linewidth=1.2, **look
                )
            axes.set(xscale="log", yscale="log", xlabel="CPU time per simulated second [s]")
            axes.grid(which="major", color=GRID, linewidth=0.5)
            axes.set_title(title, fontsize=11, loc="left", color=INK)
        panels[0].set_ylabel("Largest relative error")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=9)
    save(figure, file)


def main() -> None:
    """Print one table per case; draw the figure if there is a file for it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rounds", nargs="?", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, help="PNG file of the figure")
    options = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    tables: dict[str, Sequence[Row]] = {}
    with tempfile.TemporaryDirectory() as folder:
        cases = (
            (replace(two_fmus(Path(folder), "exact"), title="Mass and PD controller", step_size=16e-3), 3.2),
            (shaken_robot(), 2.0),
        )
        for case, duration in cases:
            true = reference(case, duration)
            second = exact_loop(duration) if "plant" in case.files else reference(case, duration, "monolithic_dae")
            difference = np.abs(true - second).max() / np.abs(true).max()
            print(f"\n{case.title}, {duration:g} s; the references differ by {difference:.1e}", flush=True)
            tables[case.title] = measure(case, duration, true, options.rounds)
            print("\n".join(table(tables[case.title])), flush=True)
    if options.output is not None:
        draw(tables, options.output)


if __name__ == "__main__":
    main()
