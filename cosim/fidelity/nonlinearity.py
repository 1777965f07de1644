"""Nonlinearity of an FMU, and the effect of the amplitude of a sine on the response and the harmonics of a system.

    nonlinearity(instance, {"x": 1e-6, "force": 0.1}, ["position"])     # 0 where it is linear
    effect = measure_amplitude_effect(scene, inputs, frequency, library)

The response G(A) is measured by co-simulation at the scene's amplitude A and at a tenth of it, with the same step, so
that the error of the step cancels:

    response    (G(A) - G(A / 10)) / (1 - 1 / 10)          harmonics    distortion(A) |G(A)|
"""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.fidelity.step_judge import judge, with_algorithm
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import block
from hfsa.cosim.measurement.rig import Rig
from hfsa.cosim.measurement.task import REST, STARTS, Bench, Settings, Task
from hfsa.cosim.results.files import Point, Signal, Status
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

STEADY = STARTS[0]

_SMALLER = 0.1
_TOLERANCE = 0.1
"""Largest remaining transient, relative to the scene's tolerance."""

_SEED = 1


@dataclass(frozen=True)
class AmplitudeEffect:
    """Effect of the amplitude on the response and on harmonics, output per input, (frequencies, outputs, inputs).

    `start` is the state in which all points began, one of `STARTS`.
    """

    response: NDArray[np.complex128]
    harmonics: NDArray[np.float64]
    start: str


def nonlinearity(instance: Instance, swing: Mapping[str, float], outputs: Sequence[str]) -> float:
    """Return the relative change of the Jacobian over the given amplitudes about the operating point; 0 if linear.

    `swing` holds the amplitudes of states, sampled states and inputs; all other variables stay constant. They are
    displaced together, in one direction and in the opposite one, in initialization mode. The change of each product
    Jacobian times amplitude, for rates, ticks and `outputs`, is divided by the largest product in the same unit. The
    result is infinite where a derivative is not finite. The FMU is left at its operating point.
    """
    known = instance.fmu.variables
    inputs = [name for name in swing if known[name].causality == "input"]
    here = block(instance, inputs, outputs)
    moving = [name for name in (*here.states, *here.sampled, *here.inputs) if swing.get(name)]
    handle = instance.handle(moving)
    values, signs = instance.get(handle).copy(), np.random.default_rng(_SEED).choice([-1.0, 1.0], len(moving))
    sizes = np.array([swing.get(name, 0.0) for name in (*here.values, *here.inputs)])
    rows = [*(rate for _, rate in instance.fmu.description.states), *here.sampled, *here.held, *here.outputs]

    def additions() -> np.ndarray:
        """Return the Jacobian times the amplitudes at the present values, (rates, ticks and outputs; variables)."""
        found = block(instance, inputs, outputs)
        return np.vstack([found.rate, found.tick, found.output]) * sizes

    before, change = additions(), np.zeros((len(rows), len(sizes)))
    try:
        for way in (signs, -signs):
            instance.set(handle, values + way * [swing[name] for name in moving])
            change = np.maximum(change, np.abs(additions() - before))
    finally:
        instance.set(handle, values)
    units = [known[name].unit for name in rows]
    largest = np.array(
        [max(np.abs(before[i]).max(initial=0) for i, u in enumerate(units) if u == unit) for unit in units]
    )
    changed = change.max(axis=1, initial=0.0)
    relative = np.divide(changed, largest, out=np.where(changed > 0, np.inf, 0.0), where=largest > 0)
    return float(np.nan_to_num(relative, nan=np.inf).max(initial=0.0))


def measure_amplitude_effect(
    scene: Scene,
    inputs: Sequence[Signal],
    frequency: NDArray[np.float64],
    library: Path | None,
    start: str = REST,
) -> AmplitudeEffect:
    """Return the effect of the scene's amplitude, measured with one input and one frequency [Hz] at a time.

    Points begin at rest, so that the remaining transients of similar systems cancel; or, a hundred times sooner at a
    resonance, on their steady states where `start` is that and all are known. Raises `StructureError` for a response
    that does not settle; `StepError` as a master.
    """
    parts, algorithm = Variants(scene).parts, with_algorithm(scene)[0].algorithm
    scene = replace(scene, algorithm=algorithm, inputs=[signal.name for signal in inputs])
    scenes = {part: _at_part(scene, part) for part in (_SMALLER, 1.0)}
    starts = {part: _starts(at, frequency, parts) if start == STEADY else {} for part, at in scenes.items()}
    if not all(signal.name in known for known in starts.values() for signal in inputs):
        starts, start = {part: {} for part in scenes}, REST
    small, full = (_points(at, inputs, frequency, parts, library, starts[part]) for part, at in scenes.items())
    response = np.zeros((len(frequency), len(scene.outputs), len(inputs)), complex)
    harmonics = np.zeros(response.shape)
    for (k, i), point in full.items():
        response[k, :, i] = (_array(point.response) - _array(small[k, i].response)) / (1 - _SMALLER)
        harmonics[k, :, i] = np.nan_to_num(_array(point.harmonic_distortion)) * np.abs(_array(point.response))
    return AmplitudeEffect(response, harmonics, start)


def _at_part(scene: Scene, part: float) -> Scene:
    """Return the scene at a part of its amplitude."""
    return replace(scene, amplitude={unit: part * size for unit, size in scene.amplitude.items()})


def _starts(scene: Scene, frequency: NDArray[np.float64], parts: Assembly) -> Mapping[str, Sequence[SteadyStart]]:
    """Return the predicted steady states at frequencies [Hz], by the inputs for which they are known."""
    variants = Variants(scene, parts)
    excited = {name: variants.instrumented(name) for name in scene.inputs}
    with judge(scene, variants.plain, excited, scene.outputs, scene.band) as known:
        return known.steady_starts(scene, frequency)[0]


def _points(
    scene: Scene,
    inputs: Sequence[Signal],
    frequency: NDArray[np.float64],
    parts: Assembly,
    library: Path | None,
    starts: Mapping[str, Sequence[SteadyStart]],
) -> dict[tuple[int, int], Point]:
    """Return the settled points of a scene by (frequency, input)."""
    settings = Settings("stepped", scene.algorithm, scene.step_size, min(1e-3, _TOLERANCE * scene.tolerance))
    variants, found = Variants(scene, parts), {}
    for i, signal in enumerate(inputs):
        assembly = with_ports(variants.instrumented(signal.name), scene.algorithm)
        amplitude = float(assembly.system[scene.source.name].start["amplitude"])
        bench = Bench(assembly, tuple(scene.outputs), scene.source.name, LOCK_IN, library)
        with contextlib.closing(Rig(bench, settings)) as rig:
            for k, f in enumerate(frequency.tolist()):
                start = starts[signal.name][k] if signal.name in starts else None
                found[k, i] = _settled(rig.measure(Task(i, k, bench, settings, f, amplitude, start)), signal, f)
    return found


def _settled(point: Point, signal: Signal, frequency: float) -> Point:
    """Return a point; `StructureError` where it has not settled."""
    if point.status is Status.NOT_SETTLED:
        raise StructureError(f"driven at {signal.name} with {frequency:.4g} Hz, {point.message}")
    return point


def _array(values: np.ndarray | None) -> np.ndarray:
    """Return the values of a measured point."""
    assert values is not None
    return values
