"""A Model Exchange importer by hand: SciPy's LSODA on the calls of fmpy, restarted wherever an input or a tick jumps.

Knows nothing of hfsa, so that it is a second opinion of FMUs of ours, and runs in the environment of another tool.
"""

import math
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from ctypes import POINTER, c_double
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.simulation import instantiate_fmu
from scipy.integrate import solve_ivp

METHODS = {
    2: ("setReal", "getReal", "getDerivatives", "newDiscreteStates"),
    3: ("setFloat64", "getFloat64", "getContinuousStateDerivatives", "updateDiscreteStates"),
}


class Exchanged:
    """An FMU in Model Exchange; `u` and `slope` are its inputs and their rates at the time `start`."""

    def __init__(self, fmu, description, inputs: Sequence[str], outputs: Sequence[str]):
        references = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = fmu
        self.size = description.numberOfContinuousStates
        self.inputs, self.outputs = [references[n] for n in inputs], [references[n] for n in outputs]
        functions = (getattr(fmu, name) for name in METHODS[description.fmiMajorVersion])
        self.write, self.read, self.rates_of, self.update_once = functions
        self.start, self.u, self.slope = 0.0, np.zeros(len(inputs)), np.zeros(len(inputs))
        self.next_event = math.inf

    def move(self, start: float, u: np.ndarray, slope: np.ndarray) -> None:
        """Let the inputs be `u + slope (t - start)` from now on."""
        self.start, self.u, self.slope = start, u, slope

    def place(self, t: float, x: np.ndarray) -> None:
        """Set time, states and inputs."""
        self.fmu.setTime(t)
        if self.size:
            self._states(self.fmu.setContinuousStates, x)
        if self.inputs:
            self.write(self.inputs, [float(v) for v in self.u + self.slope * (t - self.start)])

    def rates(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return the derivatives of the states, (n,)."""
        self.place(t, x)
        return self._states(self.rates_of, np.zeros(self.size))

    def state(self) -> np.ndarray:
        """Return the states, (n,)."""
        return self._states(self.fmu.getContinuousStates, np.zeros(self.size))

    def nominals(self) -> np.ndarray:
        """Return the nominal values of the states, (n,)."""
        return self._states(self.fmu.getNominalsOfContinuousStates, np.ones(self.size))

    def _states(self, function, values: np.ndarray) -> np.ndarray:
        values = np.ascontiguousarray(values, dtype=float).copy()
        if self.size:
            function(values.ctypes.data_as(POINTER(c_double)), self.size)
        return values

    def update(self) -> None:
        """Update the discrete states, in event mode, and go to continuous time."""
        again = True
        while again:
            again, _, _, _, defined, event = self.update_once()
            self.next_event = event if defined else math.inf
        self.fmu.enterContinuousTimeMode()

    def integrate(self, t: float, end: float, x: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the states at the end of an interval without events."""
        if self.size and end > t:
            absolute = tolerance * 1e-3 * self.nominals()
            found = solve_ivp(self.rates, (t, end), x, "LSODA", rtol=tolerance, atol=absolute)
            if not found.success:
                raise RuntimeError(f"from {t:g} to {end:g} s: {found.message}")
            x = found.y[:, -1]
        self.place(end, x)
        return x


@contextmanager
def exchanged(file: str | Path, inputs: Sequence[str], outputs: Sequence[str]) -> Iterator[Exchanged]:
    """Yield an FMU in event mode, after initialization."""
    with tempfile.TemporaryDirectory() as folder:
        description = read_model_description(str(file))
        extract(str(file), folder)
        fmu = instantiate_fmu(folder, description, "ModelExchange")
        if description.fmiMajorVersion == 2:
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        try:
            yield Exchanged(fmu, description, inputs, outputs)
        finally:
            fmu.terminate()
            fmu.freeInstance()


def simulated(
    file: str | Path,
    inputs: Sequence[str],
    outputs: Sequence[str],
    signals: np.ndarray,
    step: float,
    *,
    linear: bool,
    tolerance: float = 1e-10,
) -> np.ndarray:
    """Return the outputs at the end of each step, (steps, outputs).

    `signals` are the inputs at the communication points, (steps + 1, inputs): held over each step, or linear in it.
    """
    rows = []
    with exchanged(file, inputs, outputs) as fmu:
        x = fmu.state()
        fmu.move(0.0, signals[0], np.zeros(len(inputs)))
        fmu.place(0.0, x)
        fmu.update()
        x = fmu.state()
        for k in range(len(signals) - 1):
            t, end = k * step, (k + 1) * step
            fmu.move(t, signals[k], (signals[k + 1] - signals[k]) / step * linear)
            while t < end - 1e-9 * step:
                # a tick at the end belongs to the next step
                if fmu.next_event <= t + 1e-9 * step:
                    fmu.place(t, x)
                    fmu.fmu.enterEventMode()
                    fmu.update()
                    x = fmu.state()
                pause = fmu.next_event if fmu.next_event < end - 1e-9 * step else end
                x = fmu.integrate(t, pause, x, tolerance)
                t = pause
            rows.append(list(fmu.read(fmu.outputs)))
    return np.array(rows)
