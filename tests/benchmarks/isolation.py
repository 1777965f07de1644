"""Cost per communication step of FMUs in processes of their own, beside the same FMUs in the process of the master.

    make bench        # or: python tests/benchmarks/isolation.py [BLOCKS]

The loop in C takes BLOCKS blocks of steps, each timed by the clock on the wall, because the processes work in turn on
several processors. The least is what the exchange costs on a machine that does nothing else, the median what it costs
on this one now. A step of jacobi_plain sets, steps and gets each FMU once.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Collection
from pathlib import Path

import numpy as np
from cases import Case, two_fmus

from hfsa.cosim.assembly.isolation import isolation_library
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.fmi.co_simulation import Instance, open_instances
from hfsa.cosim.masters.algorithms import make_master

STEPS = 2000
"""Steps of a block."""


def timed(case: Case, isolated: Collection[str], blocks: int) -> tuple[np.ndarray, float]:
    """Return the time of each block per step [s], (blocks,), and the watched output at the end."""
    with open_instances(case.files, Instance, isolated, isolation_library()) as instances:
        master = make_master(instances, case.system, "jacobi_plain", case.step_size, stepping_library())
        master.initialize()
        times = []
        for _ in range(blocks):
            begin = time.perf_counter()
            master.advance(STEPS)
            times.append((time.perf_counter() - begin) / STEPS)
        return np.array(times), master.read([case.watched])[0]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blocks", nargs="?", type=int, default=200)
    blocks = parser.parse_args().blocks
    with tempfile.TemporaryDirectory() as folder:
        case = two_fmus(Path(folder), "exact")
        names = sorted(case.files)
        print(f"\n{case.title}, FMUs in processes of their own; processors {len(os.sched_getaffinity(0))}")
        print(f"{'':42} {'us/step':>9} {'median':>9}")
        ends = []
        for label, isolated in (("in this process", ()), ("one of them", names[:1]), ("both", names)):
            times, end = timed(case, isolated, blocks)
            ends.append(end)
            print(f"{label:42} {times.min() * 1e6:9.3f} {np.median(times) * 1e6:9.3f}", flush=True)
        assert len(set(ends)) == 1, "all must give the same bits"


if __name__ == "__main__":
    main()
