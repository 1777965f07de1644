"""Identification of the inertia of a platform from one manoeuvre, from a results file to another.

    found = identify("manoeuvre.h5")
    found.value, found.standard_deviation        # m, m c, I about the reference point, body axes

The equations of a rigid body are linear in its ten inertia parameters (`signals/rigid_body.py`). Each row of a run
gives six of them, each response of a sweep six complex ones; they are weighted by their standard deviations and solved
for all rows at once. The same instant of acceleration and wrench is all they need: a manoeuvre may be transient.
"""

import dataclasses
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.components import ModelError
from hfsa.cosim.assembly.models import named_part
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.body_motion import BodyMotion, Recording, Source, body_motion, body_of, read_recording
from hfsa.cosim.experiments.setup import Warn
from hfsa.cosim.results.inertia import Identification, Residuals, write_identification
from hfsa.cosim.results.records import SystemRecord
from hfsa.cosim.results.target import check_new
from hfsa.cosim.signals.least_squares import Solution, solve
from hfsa.cosim.signals.rigid_body import PARAMETERS, full_regressor, linear_regressor
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component

Regressor = Literal["full", "linear"]

_NAMES = tuple(PARAMETERS)
_UP = np.array([0.0, 0.0, 1.0])
_PAYLOAD = "payload."
"""Prefix of the arguments of a component that describe the payload of its platform."""
_SHORTEST, _LONGEST = 1e-6, 1e3
"""Levers of moment over force [m] beyond which one of them is rounding."""
_PASSES = 8
"""Passes in which standard deviations are estimated from residuals."""
_UNEVEN = 1e-4
"""Smallest ratio of the relative deviations of moments and forces: where one is exact, the other keeps a weight."""
_ALIKE = 1e-3
"""Relative difference of residuals below which regressors fit alike."""
_UNEXPECTED = 2.0
"""Ratio of residuals to given standard deviations from which a sentence says so."""


@dataclass(frozen=True)
class _Noise:
    """Standard deviations of the equations [N.m], [N]; `None` for one that is estimated from the residuals."""

    torque: float | None
    force: float | None

    @property
    def is_given(self) -> bool:
        """Whether both are given."""
        return self.torque is not None and self.force is not None


@dataclass(frozen=True)
class _Equations:
    """Equations Y p = w of a motion in body axes: Y (rows, 6, 10), w (rows, 6), real or complex."""

    Y: NDArray[Any]
    w: NDArray[Any]

    @property
    def sizes(self) -> NDArray[np.float64]:
        """Root mean squares of moment and force, (2,), the smaller one at least that of a tiny or a huge lever."""
        torque, force = _rms(self.w[:, :3]), _rms(self.w[:, 3:])
        sizes = np.array([max(torque, _SHORTEST * force), max(force, torque / _LONGEST)])
        return sizes if sizes.min() > 0 else np.ones(2)

    def solved(self, sigma: NDArray[np.float64]) -> Solution:
        """Return the weighted solution; complex equations count as two real ones."""
        weight = np.repeat(1 / sigma, 3)
        A, b = (self.Y * weight[:, None]).reshape(-1, len(_NAMES)), (self.w * weight).reshape(-1)
        if np.iscomplexobj(A) or np.iscomplexobj(b):
            A, b = np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag])
        return solve(A, b)

    def residuals(self, found: Solution, sigma: NDArray[np.float64]) -> NDArray[Any]:
        """Return the residuals of a solution in their units, (rows, 6)."""
        r = found.residuals
        if len(r) != self.w.size:
            r = r[: self.w.size] + 1j * r[self.w.size :]
        return r.reshape(self.w.shape) * np.repeat(sigma, 3)


@dataclass(frozen=True)
class _Fit:
    """Inertia identified from one file, and the residuals of its equations; `sigma` is [torque, force]."""

    solution: Solution
    sigma: NDArray[np.float64]
    residuals: NDArray[Any]
    rows: Residuals
    regressor: Regressor
    sentences: tuple[str, ...]


@checked(zero=("gravity", "low"))
def identify(
    file: str | Path,
    *,
    of: Literal["body", "payload"] = "body",
    alone: str | Path | None = None,
    motion: Literal["measured", "pose", "commanded"] = "measured",
    regressor: Literal["full", "linear"] | None = None,
    body: str | None = None,
    torque_noise: float | None = None,
    force_noise: float | None = None,
    gravity: float | None = None,
    low: float | None = None,
    high: float | None = None,
    path: str | Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
) -> Identification:
    """Identify the ten inertia parameters of a platform with its payload, and write the results file.

    Args:
        file: results file of a run or a sweep, with acceleration, twist and pose of the platform and the wrench of the
            limbs on it.
        of: the `body`, platform with payload, or the `payload`, the difference to the platform alone.
        alone: results file of a manoeuvre of the platform alone, for `payload` (default: the platform of the model).
        motion: `measured` acceleration and twist; derivatives of the recorded `pose`, over five points; or the
            `commanded` pose, as if the robot were rigid.
        regressor: `full`, or `linear` without the products of the angular velocity (default: the one that leaves the
            smaller residuals; of a sweep `linear`).
        body: component whose platform it is (default: the only one).
        torque_noise: standard deviation of each equation of moments [N.m] (default: that of the residuals).
        force_noise: standard deviation of each equation of forces [N] (default: that of the residuals).
        gravity: gravitational acceleration along -Z [m/s2] (default: that of the component in the file).
        low, high: first and last time of the rows of a run [s], or lowest and highest frequency of a sweep [Hz]
            (default: all).
        path: results file (default: beside the first, with the ending `_inertia.h5`).

    Raises:
        StructureError: signals that are missing, with what records them; options that exclude each other.
        ResultsError: files that cannot be read or written.
    """
    file = Path(file)
    target = Path(path) if path is not None else file.with_name(f"{file.stem}_inertia.h5")
    if alone is not None and of == "body":
        raise StructureError("--alone FILE is a platform without payload; expected --of payload beside it")
    if alone is not None and Path(alone).resolve() == file.resolve():
        raise StructureError(
            f"--alone {alone} is the file of the manoeuvre itself, expected that of the platform alone"
        )
    for source in (file, alone):
        if source is not None and target.resolve() == Path(source).resolve():
            raise StructureError(f"-o {target} is the file of the manoeuvre, expected another")
    check_new(target, force)
    noise = _Noise(torque_noise, force_noise)
    recording = read_recording(file, low, high)
    name = body_of(recording, body)
    if motion == "commanded":
        warn(
            "the motion is assumed to be the commanded one: what the springs add to it, most of all near a resonance, "
            "appears as inertia that is not there"
        )

    def fitted(recording: Recording) -> _Fit:
        """Return the inertia identified from one recording."""
        return _fitted(recording, name, motion, regressor, noise, gravity)

    fit = fitted(recording)
    whole, covariance = fit.solution.values, fit.solution.covariance
    component = recording.component(name)
    model, without, empty = _known(component), np.full(len(_NAMES), np.nan), _known(component, is_alone=True)
    sentences, unseen = list(fit.sentences), [[_NAMES[i] for i in group] for group in fit.solution.unseen]
    value, rank = whole, fit.solution.rank
    if of == "payload":
        _check_reference(component)
        if alone is not None:
            second = read_recording(Path(alone), low, high)
            _warn_of_another(component, second.component(name), Path(alone), warn)
            other = fitted(second)
            without, covariance = other.solution.values, covariance + other.solution.covariance
            unseen += [group for g in other.solution.unseen if (group := [_NAMES[i] for i in g]) not in unseen]
            rank = min(rank, other.solution.rank)
            sentences += [f"{Path(alone)}: {sentence}" for sentence in other.sentences]
        elif np.all(np.isfinite(empty)):
            without = empty
            sentences.append("the platform alone is that of the model, known exactly; --alone FILE identifies it")
        else:
            raise StructureError(f"the model of {name} does not tell its platform alone; --alone FILE identifies it")
        value, model = whole - without, model - empty
    found = Identification(
        path=target,
        source=str(file),
        alone_file="" if alone is None else str(alone),
        body=name,
        of=of,
        motion=motion,
        regressor=fit.regressor,
        parameters=PARAMETERS,
        value=value,
        covariance=covariance,
        model=model,
        whole=whole,
        alone=without,
        condition_number=fit.solution.condition,
        rank=rank,
        unseen=unseen,
        torque_noise=float(fit.sigma[0]),
        force_noise=float(fit.sigma[1]),
        torque_residual=_rms(fit.residuals[:, :3]),
        force_residual=_rms(fit.residuals[:, 3:]),
        residuals=dataclasses.replace(fit.rows, values=fit.residuals),
        sentences=sentences,
    )
    write_identification(found, SystemRecord(recording.title, recording.text), force)
    return found


def _fitted(
    recording: Recording,
    body: str,
    motion: Source,
    regressor: Regressor | None,
    noise: _Noise,
    gravity: float | None,
) -> _Fit:
    """Return the inertia identified from one recording."""
    moved = body_motion(recording, body, motion)
    component = recording.component(body)
    attitude = _analyzed(component).get("attitude")
    sentences = []
    if attitude is None:
        sentences.append(f"the attitude of {body} at its posture is not known: body axes are world axes there")
        attitude = np.eye(3)
    weight = (0.0 if component is None else float(component.start.get("gravity", 0.0))) if gravity is None else gravity
    builders: dict[Regressor, Callable[[], _Equations]] = {
        "full": lambda: _full(moved, np.asarray(attitude), weight),
        "linear": lambda: _linear(moved, np.asarray(attitude), weight),
    }
    if moved.change is None:
        if regressor == "full":
            raise StructureError(f"{recording.path} is a sweep, whose responses are linear; regressor full takes a run")
        if gravity is not None:
            raise StructureError(f"{recording.path} is a sweep, and gravity is no part of responses; it takes a run")
        regressor = "linear"
    if regressor is None:
        regressor, sentence = _better({name: build() for name, build in builders.items()})
        sentences.append(sentence)
    equations = builders[regressor]()
    sigma = _deviations(equations, noise)
    solution = equations.solved(sigma)
    residuals = equations.residuals(solution, sigma)
    sentences += _judged(residuals, sigma, noise)
    # rounding is alike in all equations and does not average out
    rounding = residuals.size * float((np.finfo(float).eps * equations.sizes / sigma).max()) ** 2
    solution = dataclasses.replace(solution, covariance=solution.covariance * (1 + rounding))
    return _Fit(solution, sigma, residuals, moved.rows, regressor, tuple(sentences))


def _full(moved: BodyMotion, attitude: NDArray[np.float64], gravity: float) -> _Equations:
    """Return the equations of a body at its attitude at each instant."""
    if moved.change is None or moved.angular_acceleration is None or moved.angular_velocity is None:
        raise ValueError("responses have no attitude")
    Q = (moved.change + np.eye(3)) @ attitude

    def along(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the body components of vectors in world axes."""
        return np.einsum("nji,nj->ni", Q, vectors)

    felt = along(moved.acceleration + gravity * _UP)
    Y = full_regressor(felt, along(moved.angular_acceleration), along(moved.angular_velocity))
    return _Equations(Y, np.hstack([along(moved.torque), along(moved.force)]))


def _linear(moved: BodyMotion, attitude: NDArray[np.float64], gravity: float) -> _Equations:
    """Return the linear equations of a body about its posture; gravity is no part of responses."""
    felt = moved.acceleration + (0.0 if moved.change is None else gravity) * _UP
    Y = linear_regressor(felt @ attitude, moved.rotation_acceleration @ attitude)
    return _Equations(Y, np.hstack([moved.torque @ attitude, moved.force @ attitude]))


def _better(candidates: dict[Regressor, _Equations]) -> tuple[Regressor, str]:
    """Return the regressor with the smaller residuals, relative to moment and force, and a sentence; alike: `full`."""
    left = {}
    for name, equations in candidates.items():
        found = equations.solved(equations.sizes)
        left[name] = _rms(found.residuals)
    chosen: Regressor = "linear" if left["linear"] < (1 - _ALIKE) * left["full"] else "full"
    words = ", ".join(f"{name} {100 * size:.2g} %" for name, size in left.items())
    return chosen, f"regressor {chosen}: residuals of {words} of the wrench"


def _deviations(equations: _Equations, noise: _Noise) -> NDArray[np.float64]:
    """Return the standard deviations of moments and forces, given or estimated from the residuals, (2,)."""
    sizes = equations.sizes
    given = np.array([np.nan if s is None else s for s in (noise.torque, noise.force)])
    is_given = np.isfinite(given)
    sigma = np.where(is_given, given, sizes)
    if noise.is_given:
        return sigma
    count = equations.w[:, :3].size * (2 if np.iscomplexobj(equations.w) else 1)
    for _ in range(_PASSES):
        found = equations.solved(sigma)
        r = equations.residuals(found, sigma)
        # each block of equations has determined a half of the unknowns
        free = max(count - found.rank / 2, 1.0)
        squares = np.array([np.sum(np.abs(block) ** 2) for block in (r[:, :3], r[:, 3:])])
        relative = np.maximum(np.sqrt(squares / free) / sizes, np.finfo(float).eps)
        sigma = np.where(is_given, given, np.maximum(relative, _UNEVEN * relative.max()) * sizes)
    return sigma


def _judged(residuals: NDArray[Any], sigma: NDArray[np.float64], noise: _Noise) -> list[str]:
    """Return sentences on residuals that exceed the given standard deviations."""
    parts = (
        ("moments", "N.m", noise.torque, residuals[:, :3], sigma[0]),
        ("forces", "N", noise.force, residuals[:, 3:], sigma[1]),
    )
    factor = np.sqrt(2.0) if np.iscomplexobj(residuals) else 1.0
    return [
        f"the residuals of {what}, {size:.3g} {unit}, exceed the given {given:.3g} {unit}: the standard deviations are "
        "too small"
        for what, unit, given, block, _ in parts
        if given is not None and (size := _rms(block) / factor) > _UNEXPECTED * given
    ]


def _known(component: Component | None, *, is_alone: bool = False) -> NDArray[np.float64]:
    """Return the inertia parameters of a component's model, NaN where it does not tell them.

    `is_alone` takes its payload off.
    """
    found = _analyzed(component, is_alone=is_alone).get("inertia_parameters_S")
    is_about_s = component is None or component.arguments.get("reference_point", "S") == "S"
    return np.full(len(_NAMES), np.nan) if found is None or not is_about_s else np.asarray(found, dtype=float)


def _warn_of_another(with_payload: Component | None, alone: Component | None, file: Path, warn: Warn) -> None:
    """Warn where the model of a file is not that of the platform alone of the manoeuvre."""
    expected, found = _known(with_payload, is_alone=True), _known(alone)
    if np.all(np.isfinite([expected, found])) and not np.allclose(found, expected, rtol=1e-9, atol=1e-12):
        warn(
            f"{file} is of a platform of {found[0]:.6g} kg by its model, but that of the manoeuvre has "
            f"{expected[0]:.6g} kg without its payload: the difference is not the payload"
        )


def _analyzed(component: Component | None, *, is_alone: bool = False) -> dict[str, Any]:
    """Return the engineering numbers of a component's part, empty where it has none."""
    if component is None or component.is_foreign:
        return {}
    arguments = dict(component.arguments)
    if is_alone:
        arguments = {name: v for name, v in arguments.items() if not name.startswith(_PAYLOAD)} | {"payload.mass": 0.0}
    try:
        return named_part(component).analysis(**arguments)
    except ModelError:
        return {}


def _check_reference(component: Component | None) -> None:
    """Raise `StructureError` where the reference point moves with the payload."""
    if component is not None and component.arguments.get("reference_point", "S") != "S":
        raise StructureError(
            f"{component.name} has its signals at reference_point {component.arguments['reference_point']}, which "
            "depends on the payload; expected S for the payload"
        )


def _rms(values: NDArray[Any]) -> float:
    """Return the root mean square of real or complex values."""
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if values.size else 0.0
