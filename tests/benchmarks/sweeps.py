"""Cost of a frequency response: the sweep of a scene beside a loop with fmpy as one writes it by hand.

    make bench        # or: python tests/benchmarks/sweeps.py [ROUNDS] [--methods]

The loop by hand steps the two FMUs of `sdelta_shaker` with the scene's communication step: it sets a sine with its
derivatives, waits 3.4 s, in which the transient falls to 0.5 %, and fits a sine to two periods by least squares.
Ours is `hfsa sweep` as a command, on one processor: start, FMUs, choice of the algorithm, theory and file included; a
single point is its `wall_time` in that file. Commands run ROUNDS times, in turn, and the shortest CPU time counts.
Errors are against the linear response, which has no steps.

A second table has the methods side by side: `linear`, `multisine` and `stepped` of one scene, each with the number of
its frequencies. The FMUs of all are built before a command is timed.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from hfsa.cosim import load_scene, read
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.rig import Settings
from hfsa.cosim.measurement.sweep import linear, plan_sweep
from hfsa.cosim.results.files import Bode

SETTLING, PERIODS = 3.4, 2
SCENE, INPUT, OUTPUT = "sdelta_shaker", "reference.command.position[3]", "robot.platform.position[3]"


class ByHand:
    """The FMUs `reference` and `robot` in a plain loop of Python."""

    def __init__(self, assembly: Assembly, step_size: float, folder: Path):
        self.assembly, self.step_size = assembly, step_size
        self.reference, self.robot = (self._slave(name, folder / name) for name in ("reference", "robot"))
        pairs = [(c.start, c.end) for c in assembly.system.connections]
        wires = [pair for pair in pairs if pair[0].startswith("reference.") and pair[1].startswith("robot.")]
        self.tubes = [self._number(start) for start, _ in wires], [self._number(end) for _, end in wires]
        sources = ("source.value", "source.rate", "source.acceleration")
        ends = dict(pairs)
        self.motion = [self._number(ends[name]) for name in sources]
        self.output = [self._number(OUTPUT)]

    def response(self, frequency: float, amplitude: float) -> complex:
        """Return the response at a frequency [Hz] to a sine of an amplitude [m]."""
        h, w = self.step_size, 2 * np.pi * frequency
        for slave in (self.reference, self.robot):
            slave.reset()
            slave.setupExperiment()
            own = self.assembly.system[slave.instanceName].start
            slave.setReal([self._number(f"{slave.instanceName}.{name}") for name in own], list(own.values()))
            slave.enterInitializationMode()
        for slave in (self.reference, self.robot):
            slave.exitInitializationMode()
        settled, last = round(SETTLING / h), round((SETTLING + PERIODS / frequency) / h)
        found = []
        for k in range(last):
            t = k * h
            sine, cosine = amplitude * np.sin(w * t), amplitude * np.cos(w * t)
            self.reference.setReal(self.motion, [sine, w * cosine, -(w**2) * sine])
            self.reference.doStep(t, h)
            self.robot.setReal(self.tubes[1], self.reference.getReal(self.tubes[0]))
            self.robot.doStep(t, h)
            if k >= settled:
                found += self.robot.getReal(self.output)
        instants = np.arange(settled + 1, last + 1) * h
        waves = np.column_stack([np.sin(w * instants), np.cos(w * instants), np.ones(len(instants))])
        real, imaginary, _ = np.linalg.lstsq(waves, np.array(found), rcond=None)[0]
        return complex(real, imaginary) / amplitude

    def _slave(self, name: str, folder: Path) -> FMU2Slave:
        description, file = self.assembly.descriptions[name], str(self.assembly.files[name])
        unzipped = fmpy.extract(file, str(folder))
        slave = FMU2Slave(
            guid=description.token,
            modelIdentifier=description.identifier,
            unzipDirectory=unzipped,
            instanceName=name,
        )
        slave.instantiate()
        return slave

    def _number(self, full: str) -> int:
        """Return the value reference of a variable, by its full name."""
        name, _, variable = full.partition(".")
        return self.assembly.descriptions[name].variables[variable].reference


def by_hand(frequency: Sequence[float]) -> tuple[list[float], list[complex]]:
    """Return the CPU time [s] and the response at each frequency [Hz], by hand."""
    scene = load_scene(SCENE)
    assembly = Variants(scene).instrumented(INPUT, [OUTPUT])
    seconds, found = [], []
    with tempfile.TemporaryDirectory() as folder:
        loop = ByHand(assembly, scene.step_size, Path(folder))
        for single in frequency:
            begin = time.process_time()
            found.append(loop.response(single, scene.amplitude["m"]))
            seconds.append(time.process_time() - begin)
    return seconds, found


def command(file: Path, *words: str, scene: str = SCENE) -> float:
    """Return the CPU time [s] of a sweep as a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = [sys.executable, "-m", "hfsa.cosim.cli", "sweep", scene, *words, "-o", str(file), "--force"]
    subprocess.run(own, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


NONLINEAR = ("-p", "sensor.level=nonlinear", "--input", "sensor.base.acceleration[2]", "--to", "500", "--points", "8")
CASES = {
    "sdelta_shaker, 1 input, 6 outputs": ("sdelta_shaker", ("--input", INPUT), ()),
    "sdelta_shaker, 6 inputs": ("sdelta_shaker", (), ()),
    "sdelta_shaker, 6 inputs together": ("sdelta_shaker", (), ("--inputs", "together")),
    "sdelta_hfsa (sampled), 1 input": ("sdelta_hfsa", ("--input", INPUT), ()),
    "accelerometer_shaker, nonlinear, 1 input": ("accelerometer_shaker", NONLINEAR, ()),
    "  from rest": ("accelerometer_shaker", NONLINEAR, ("--start", "rest")),
}


def off(bode: Bode, scene: str, words: Sequence[str]) -> float:
    """Return the largest difference of a sweep from the linear response, relative to the largest of an input."""
    levels = dict([word.split("=") for word in words if "=" in word])
    at = load_scene(scene, levels)
    inputs, outputs = ([signal.name for signal in side] for side in (bode.inputs, bode.outputs))
    assembly = Variants(at).plain
    plan = plan_sweep(assembly, inputs, outputs, bode.frequency, at.amplitude, Settings("linear"))
    exact = linear(assembly, plan).response(bode.frequency)
    return float(np.nanmax(np.abs(bode.response - exact) / np.abs(exact).max(axis=(0, 1))))


def methods(rounds: int) -> None:
    """Print cost and error of the methods of a sweep, side by side."""
    print(f"\n{'':42} {'method':10} {'CPU time':>9} {'runs':>9} {'points':>7} {'error':>8}")
    with tempfile.TemporaryDirectory() as folder:
        for label, (scene, words, of_measured) in CASES.items():
            ways = {"linear": (), "multisine": of_measured, "stepped": of_measured}
            if "--inputs" in of_measured:
                ways = {"multisine": of_measured}
            if "--start" in of_measured:
                ways = {"multisine": of_measured, "stepped": of_measured}
            best = dict.fromkeys(ways, float("inf"))
            for _ in range(rounds + 1):  # the first builds FMUs
                for method, own in ways.items():
                    more = own if method == "linear" else ("-j", "1", *own)
                    file = Path(folder, f"{method}.h5")
                    taken = command(file, *words, "--method", method, *more, scene=scene)
                    best[method] = min(best[method], taken)
            for method, taken in best.items():
                bode = read(Path(folder, f"{method}.h5"))
                measured = float(np.nansum(bode.wall_time))
                points = int(np.isfinite(bode.response[:, 0]).sum())
                error = off(bode, scene, words)
                print(f"{label:42} {method:10} {taken:7.2f} s {measured:7.2f} s {points:7} {error:8.1e}", flush=True)
                label = ""


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="Cost of a frequency response, beside a loop written by hand.")
    parser.add_argument("rounds", nargs="?", type=int, default=2)
    parser.add_argument("--methods", action="store_true", help="the table of methods alone")
    given = parser.parse_args(words)
    rounds = given.rounds
    if given.methods:
        methods(rounds)
        return
    vertical = ("--input", INPUT, "--signal", OUTPUT, "--points", "40", "-j", "1")
    ways = {
        "hfsa sweep, 1 input, 1 output": vertical,
        "  from rest": (*vertical, "--start", "rest"),
        "hfsa sweep, 6 inputs, 6 outputs": ("--points", "40", "-j", "1"),
        "  from rest ": ("--points", "40", "-j", "1", "--start", "rest"),
    }
    best = dict.fromkeys(ways, float("inf"))
    with tempfile.TemporaryDirectory() as folder:
        files = {label: Path(folder, f"{k}.h5") for k, label in enumerate(ways)}
        for _ in range(rounds):
            for label, own in ways.items():
                best[label] = min(best[label], command(files[label], *own))
        sweeps = {label: read(file) for label, file in files.items()}
    first, rest, *_ = sweeps.values()
    theory = first.theory
    frequency = first.frequency
    exact = np.interp(frequency, theory.frequency, theory.response[:, 0, 0]) if theory is not None else None
    peak = int(np.argmax(np.abs(first.response[:, 0, 0])))
    few = sorted({0, len(frequency) // 2, peak, len(frequency) - 1})
    seconds, found = by_hand([frequency[k] for k in few])
    mean = float(np.mean(seconds))
    print(f"{SCENE}, step {load_scene(SCENE).step_size * 1e6:g} us; by hand {len(few)} of 40 points were timed\n")
    print(f"{'':44} {'CPU time':>10} {'by hand':>10} {'ratio':>7}")
    for label, inputs in zip(ways, (1, 1, 6, 6), strict=True):
        hand = 40 * inputs * mean
        print(f"{label:44} {best[label]:8.2f} s {hand:8.1f} s {hand / best[label]:7.0f}")
    hand = seconds[few.index(peak)]
    for label, bode in (("point at resonance", first), ("  from rest", rest)):
        own = float(bode.wall_time[peak, 0])
        print(f"{label:44} {own * 1e3:7.2f} ms {hand:8.2f} s {hand / own:7.0f}")
    if exact is not None:
        own = np.abs(first.response[few, 0, 0] / exact[few] - 1).max()
        theirs = np.abs(np.array(found) / exact[few] - 1).max()
        print(f"\nlargest error at these points: hfsa {own:.1e}, by hand {theirs:.1e}")
    methods(rounds)


if __name__ == "__main__":
    main()
