"""Predictions of `hfsa trade` beside measurements, over random scenes.

    python tests/benchmarks/trades.py [COUNT]

Each line is a scene with its answer: ratios of predicted to measured error (the worst) and cost (the median and the
worst), and how many times cheaper the answer is than the default of the scene.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from random_scenes import COUNT, random_scene

from hfsa.cosim import trade


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Predictions of hfsa trade beside measurements.")
    parser.add_argument("count", nargs="?", type=int, default=COUNT)
    count = parser.parse_args(words).count
    every = []
    print(f"{'scene':22}{'tolerance':>10}{'error':>9}{'worst ratio':>13}{'cost ratio':>12}{'worst':>8}{'cheaper':>9}")
    for seed in range(count):
        name, arguments, excited, tolerance = random_scene(seed)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "t.h5")
            found = trade(name, arguments, inputs=[excited], tolerance=tolerance, path=path, warn=lambda _: None)
        rows = [row for row in found.rows if row.is_measured]
        errors = [r.predicted_error / r.measured_error for r in rows if min(r.measured_error, r.predicted_error) > 1e-6]
        costs = np.array([row.predicted_cost / row.measured_cost for row in rows])
        every += costs.tolist()
        worst = max((max(ratio, 1 / ratio) for ratio in errors), default=1.0)
        best, own = found.best, None if found.own is None else found.rows[found.own]
        error = float("nan") if best is None else best.measured_error
        cheaper = float("nan") if best is None or own is None else own.cost / best.cost
        spread = np.exp(np.abs(np.log(costs)).max())
        print(
            f"{name:22}{tolerance:10.1e}{error:9.1e}{worst:13.3f}{np.median(costs):12.2f}{spread:8.2f}{cheaper:9.1f}",
            flush=True,
        )
    within = np.mean(np.abs(np.log(every)) <= np.log(1.3))
    print(f"\ncosts within 30 %: {100 * within:.0f} % of {len(every)} configurations")


if __name__ == "__main__":
    main()
