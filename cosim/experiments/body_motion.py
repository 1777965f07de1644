"""Motion of a platform and the wrench on it, as a results file holds them: over time, or as responses to sines.

    recording = read_recording(Path("manoeuvre.h5"))
    motion = body_motion(recording, "robot", "measured")

The signals of a component are `platform.rotation`, `.angular_velocity`, `.angular_acceleration`, `.acceleration`, the
wrench of its limbs on the platform, `limbs.torque`, `.force`, and an applied one, `wrench.torque`, `.force`. A signal
that is not recorded is taken from the output that feeds it, or is the start value of an input that nothing feeds.
"""

import contextlib
import dataclasses
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.files import Bode, ResultsError, Status
from hfsa.cosim.results.inertia import Residuals
from hfsa.cosim.results.read import read
from hfsa.cosim.results.run import Run
from hfsa.cosim.results.store import reading
from hfsa.cosim.signals.differentiation import REACH, derivatives
from hfsa.cosim.signals.rigid_body import rates, turned
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import compact, expand, nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene_text
from hfsa.cosim.systems.system import Component

Source = Literal["measured", "pose", "commanded"]

_COMMAND = re.compile(r"^(.*\.command)\.(rotation|position)\[[1-3]\]$")
_BODY = re.compile(r"^(.*)\.(limbs|platform)\.\w+\[[1-3]\]$")
_UNIFORM = 1e-6
"""Largest relative difference of the steps of a signal that is differentiated."""
_MEASURED = (Status.DONE, Status.NOT_SETTLED, Status.DISAGREES)
"""Points of a sweep that obey the equations of the body, also where they have not settled or are not linear."""


@dataclass(frozen=True)
class Recording:
    """Signals of a results file by full name, (rows,): values over time, or complex responses of a sweep.

    A response is that to the amplitude of its input; the excited input itself is among the signals.

    Attributes:
        scene: the scene as stored, `None` where the file holds no text of one.
        title, text: title of the file, and text of the scene.
        time: time of the rows of a run [s], `None` for a sweep.
        frequency, inputs: frequency [Hz] and excited input of the rows of a sweep.
    """

    path: Path
    signals: Mapping[str, NDArray[Any]]
    scene: Scene | None
    title: str
    text: str
    time: NDArray[np.float64] | None = None
    frequency: NDArray[np.float64] | None = None
    inputs: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.inputs) if self.time is None else len(self.time)

    def vectors(self, names: Iterable[str]) -> tuple[list[NDArray[Any]], list[str]]:
        """Return vectors of three, (rows, 3), by name without index, and the full names of what is not known."""
        groups = [expand(f"{name}[1..3]") for name in names]
        found = {full: self._signal(full) for group in groups for full in group}
        missing = [full for full, values in found.items() if values is None]
        known = {full: values for full, values in found.items() if values is not None}
        return ([] if missing else [np.stack([known[full] for full in group], axis=1) for group in groups]), missing

    def within(self, low: float, high: float) -> "Recording":
        """Return the rows with a time [s] or a frequency [Hz] within bounds."""
        axis = self.time if self.time is not None else self.frequency
        kept = np.ones(self.rows, bool) if axis is None else (low <= axis) & (axis <= high)
        return dataclasses.replace(
            self,
            signals={name: values[kept] for name, values in self.signals.items()},
            time=None if self.time is None else self.time[kept],
            frequency=None if self.frequency is None else self.frequency[kept],
            inputs=tuple(name for name, is_kept in zip(self.inputs, kept, strict=False) if is_kept),
        )

    def component(self, name: str) -> Component | None:
        """Return a component of the scene, also one within a fused FMU; `None` where it is not known."""
        known = () if self.scene is None else self.scene.system.components
        everything = [member for whole in known for member in (whole, *whole.members)]
        return next((component for component in everything if component.name == name), None)

    def _signal(self, name: str) -> NDArray[Any] | None:
        """Return a signal, recorded, fed by a recorded output, or constant; `None` where it is not known."""
        if name in self.signals:
            return self.signals[name]
        if self.scene is None:
            return None
        fed = {connection.end: connection.start for connection in self.scene.system.connections}
        if name in fed:
            return self.signals.get(fed[name])
        instance, _, variable = name.partition(".")
        component = self.component(instance)
        if component is None or not variable.startswith(("wrench.", "command.")):
            return None
        # an input that nothing feeds; its constant value is no part of a response
        constant = component.start.get(variable, 0.0) if self.time is not None else 0.0
        return np.full(self.rows, float(constant))


@dataclass(frozen=True)
class BodyMotion:
    """Motion of a body, world axes, and the wrench of its suspension and its applied load on it, [torque; force].

    Attributes:
        acceleration: acceleration of the reference point, (rows, 3) [m/s2].
        rotation_acceleration: second derivative of the rotation vector, (rows, 3) [rad/s2].
        angular_acceleration, angular_velocity: (rows, 3) [rad/s2], [rad/s]; `None` for a sweep.
        change: rotation from the posture minus the identity, (rows, 3, 3); `None` for a sweep.
        torque, force: (rows, 3) [N.m], [N].
        rows: where the rows come from, with residuals of zero.
    """

    acceleration: NDArray[Any]
    rotation_acceleration: NDArray[Any]
    angular_acceleration: NDArray[np.float64] | None
    angular_velocity: NDArray[np.float64] | None
    change: NDArray[np.float64] | None
    torque: NDArray[Any]
    force: NDArray[Any]
    rows: Residuals


def read_recording(path: Path, low: float | None = None, high: float | None = None) -> Recording:
    """Read the signals of a run or of a sweep; `ResultsError` where the file holds neither or no rows.

    `low` and `high` bound the time of a run [s] or the frequency of a sweep [Hz].
    """
    found = read(path)
    with reading(path) as file:
        title, text = hdf5.text(file.attrs["title"]), hdf5.text(file["system"].attrs.get("scene", ""))
    scene = None
    with contextlib.suppress(StructureError):  # files of other makers have a text of their own
        scene = read_scene_text(text)
    known = {"path": path, "scene": scene, "title": title, "text": text}
    recording = _of_run(found, known) if isinstance(found, Run) else _of_sweep(found, known)
    within = recording.within(-np.inf if low is None else low, np.inf if high is None else high)
    if not within.rows:
        place = "" if low is None and high is None else f" from {low or 0:g} to {high or np.inf:g}"
        raise ResultsError(f"{path} holds no finished row of a run or point of a sweep{place}")
    return within


def body_of(recording: Recording, wanted: str | None) -> str:
    """Return the component whose platform is the body; `StructureError` unless there is exactly one or it is named."""
    bodies = list(dict.fromkeys(match[1] for name in recording.signals if (match := _BODY.match(name))))
    if wanted is not None:
        if wanted not in bodies:
            raise StructureError(f"{recording.path} has no platform of a component {wanted!r}{nearest(wanted, bodies)}")
        return wanted
    if len(bodies) != 1:
        found = f"several platforms, of {', '.join(bodies)}; --body names one" if bodies else "no platform"
        raise StructureError(
            f"{recording.path} has {found}"
            + ("" if bodies else ", expected signals COMPONENT.platform.acceleration[1..3] and their likes")
        )
    return bodies[0]


def body_motion(recording: Recording, body: str, source: Source) -> BodyMotion:
    """Return the motion of a platform and the wrench on it.

    `source` is `measured`, the recorded twist and acceleration, `pose`, derivatives of the recorded pose, or
    `commanded`, derivatives of the commanded pose. `StructureError` names the signals that are missing.
    """
    wrench = [f"{body}.{at}.{kind}" for at in ("limbs", "wrench") for kind in ("torque", "force")]
    if source == "measured":
        names = [f"{body}.platform.{kind}" for kind in ("acceleration", "angular_acceleration")]
        if recording.time is not None:
            names += [f"{body}.platform.{kind}" for kind in ("angular_velocity", "rotation")]
    else:
        place = f"{body}.platform" if source == "pose" else _command(recording)
        names = [f"{place}.rotation", f"{place}.position"]
    vectors, missing = recording.vectors([*names, *wrench])
    if missing:
        raise StructureError(_advice(recording, missing, source))
    motion, (torque, force, applied_torque, applied_force) = vectors[: len(names)], vectors[len(names) :]
    torque, force = torque + applied_torque, force + applied_force
    if recording.time is None:
        return _of_responses(recording, motion, source, torque, force)
    if source == "measured":
        a, b, w, rotation = motion
        rows = Residuals(np.zeros((recording.rows, 6)), time=recording.time)
        return BodyMotion(a, b, b, w, turned(rotation), torque, force, rows)
    step, kept = _step(recording), slice(REACH, recording.rows - REACH)
    (rotation, position), change = motion, turned(motion[0])
    w, b = rates(change[kept], *derivatives(change, step))
    rows = Residuals(np.zeros((len(w), 6)), time=recording.time[kept])
    second = [derivatives(samples, step)[1] for samples in (position, rotation)]
    return BodyMotion(second[0], second[1], b, w, change[kept], torque[kept], force[kept], rows)


def _of_responses(
    recording: Recording, motion: list[NDArray[Any]], source: Source, torque: NDArray[Any], force: NDArray[Any]
) -> BodyMotion:
    """Return the motion of complex responses."""
    frequency = np.zeros(0) if recording.frequency is None else recording.frequency
    rows = Residuals(np.zeros((recording.rows, 6), complex), frequency=frequency, inputs=recording.inputs)
    if source == "measured":
        a, b = motion
    else:
        b, a = (-((2 * np.pi * frequency[:, None]) ** 2) * vector for vector in motion)
    return BodyMotion(a, b, None, None, None, torque, force, rows)


def _of_run(run: Run, known: Mapping[str, Any]) -> Recording:
    """Return the signals of a run."""
    return Recording(**known, signals=run.values, time=run.time)


def _of_sweep(bode: Bode, known: Mapping[str, Any]) -> Recording:
    """Return the responses of a sweep to the amplitudes of its inputs, at the points that were measured."""
    is_measured = np.isin(bode.status, [int(status) for status in _MEASURED])
    is_measured &= np.all(np.isfinite(bode.response), axis=1)
    points, sources = np.nonzero(is_measured)
    amplitude = np.array([signal.amplitude for signal in bode.inputs])
    amplitude = np.where(np.isfinite(amplitude), amplitude, 1.0)[sources]
    outputs = {s.name: bode.response[points, o, sources] * amplitude for o, s in enumerate(bode.outputs)}
    excited = {s.name: np.where(sources == i, amplitude, 0.0) + 0j for i, s in enumerate(bode.inputs)}
    names = tuple(bode.inputs[i].name for i in sources)
    return Recording(**known, signals={**excited, **outputs}, frequency=bode.frequency[points], inputs=names)


def _command(recording: Recording) -> str:
    """Return the place of the commanded pose, `reference.command`; `StructureError` unless there is exactly one."""
    ends = () if recording.scene is None else [c.end for c in recording.scene.system.connections]
    names = [*recording.signals, *ends, *(() if recording.scene is None else recording.scene.inputs)]
    places = list(dict.fromkeys(match[1] for name in names if (match := _COMMAND.match(name))))
    if len(places) != 1:
        found = f"several commanded poses, {', '.join(places)}" if places else "no commanded pose"
        raise StructureError(f"{recording.path} has {found}, expected one, COMPONENT.command.rotation and .position")
    return places[0]


def _step(recording: Recording) -> float:
    """Return the step of a run [s]; `StructureError` unless it is uniform and there are five rows."""
    steps = np.diff(np.zeros(0) if recording.time is None else recording.time)
    if len(steps) < 2 * REACH:
        raise StructureError(
            f"{recording.path} has {recording.rows} rows, expected five or more to differentiate a pose"
        )
    step = float(steps.mean())
    if np.abs(steps - step).max() > _UNIFORM * step:
        raise StructureError(
            f"{recording.path} has steps from {steps.min():.4g} to {steps.max():.4g} s, expected equal ones to "
            "differentiate a pose"
        )
    return step


def _advice(recording: Recording, missing: list[str], source: Source) -> str:
    """Return the sentence on signals that are missing, with what records them."""
    names = compact(missing)
    verb = "sweep" if recording.time is None else "run"
    words = f"{recording.path} lacks {', '.join(names)}: record with `hfsa {verb} SCENE "
    words += " ".join(f"--signal {name}" for name in names) + "`"
    has_pose = not any(".limbs." in name or ".wrench." in name for name in missing) and source == "measured"
    return words + ("; --motion pose differentiates a recorded pose instead" if has_pose else "")
