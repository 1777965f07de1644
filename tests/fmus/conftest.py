"""Models that together use the whole runtime, compiled once per session, with the classes of fmpy."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Model, FMU3Slave

from hfsa.components import Model
from hfsa.components._modelling.model import Kind
from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.fmus.c_code import Sources, generate
from hfsa.fmus.compile import compile_library


def pendulum() -> Model:
    """Nonlinear, driven, with time in the derivative and in an output, and an output that feeds the input through."""
    m = Model("Pendulum", "Driven pendulum")
    length = m.parameter("length", 0.5, "m", "Length", min=0.01, max=10.0)
    damping = m.parameter("damping", 0.1, "1/s", "Damping", min=0)
    torque = m.input("torque", "1/s2", "Torque by inertia")
    q = m.state("angle", "rad", "Angle", start=0.4)
    w = m.state("rate", "rad/s", "Angular velocity", nominal=4.0)
    m.der[q] = w
    m.der[w] = -9.81 / length * ca.sin(q) - damping * w + torque * ca.cos(3 * m.time)
    m.output("energy", 0.5 * w**2 - 9.81 / length * ca.cos(q), "1/s2", "Energy by inertia")
    m.output("feed", torque * ca.sin(m.time) + length / (1 + q**2), "1", "Feedthrough")
    m.information.update({"level": "ideal", "rotation[1]": 10.0})
    return m


def two_link() -> Model:
    """Mass-matrix form, with time in the force."""
    m = Model("TwoLink", "Two links")
    q = m.state("q[1..2]", "rad", "Joint angles", start=[0.3, -0.2])
    v = m.state("v[1..2]", "rad/s", "Joint rates", nominal=2.0)
    u = m.input("torque[1..2]", "N.m", "Joint torques")
    k = m.parameter("gravity", 5.0, "N.m", "Gravity")
    m.der[q] = v
    c = ca.cos(q[1])
    mass = ca.vertcat(ca.horzcat(3 + 2 * c, 1 + c), ca.horzcat(1 + c, 1))
    a = m.motion(v, mass=mass, force=u - k * ca.sin(q) * ca.cos(m.time) - 0.1 * v)
    m.output("acceleration[1..2]", a, "rad/s2", "Joint accelerations")
    m.output("energy", v.T @ mass @ v / 2, "J", "Kinetic energy")
    return m


def chain() -> Model:
    """Linear in mass-matrix form: three masses on springs, coupled by inertia too."""
    m = Model("Chain", "Three masses in a row")
    k = m.parameter("stiffness", 900.0, "N/m", "Springs", min=0)
    u = m.input("force", "N", "Force on the last mass")
    x = m.state("x[1..3]", "m", "Positions", start=[0.1, 0.0, -0.1], nominal=0.1)
    v = m.state("v[1..3]", "m/s", "Velocities", nominal=3.0)
    m.der[x] = v
    stiffness = ca.DM([[2, -1, 0], [-1, 2, -1], [0, -1, 1]])
    mass = ca.DM([[2, 0.1, 0], [0.1, 2, 0.1], [0, 0.1, 1]])
    a = m.motion(v, mass=mass, force=-k * (stiffness @ x) - 0.4 * v + ca.vertcat(0, 0, u))
    m.output("acceleration", a[2], "m/s2", "Acceleration of the last mass", nominal=90.0)
    return m


def controller() -> Model:
    """Sampled, with an output that is evaluated whenever it is read."""
    m = Model("Controller", "Sampled integral controller")
    sample_time = m.sample_time(1e-3)
    gain = m.parameter("gain", 20.0, "1/s", "Integral gain")
    u = m.input("error", "1", "Control error")
    z = m.sampled_state("integral", "1.s", "Integral of the error", start=0.25)
    m.next[z] = z + u * sample_time
    m.sampled_output("command", gain * z + u * ca.cos(m.time), "1", "Command", start=-1.0)
    m.output("now", gain * z + 2 * u, "1", "What the command would be")
    return m


def hybrid() -> Model:
    """A linear mass with its sampled controller: continuous and sampled states in one model."""
    m = Model("Hybrid", "Mass under sampled control")
    m.sample_time(2e-3)
    k = m.parameter("stiffness", 400.0, "N/m", "Spring", min=0)
    u = m.input("target", "m", "Target")
    x = m.state("position", "m", "Position", start=1.0)
    v = m.state("velocity", "m/s", "Velocity", nominal=20.0)
    z = m.sampled_state("force", "N", "Held force")
    m.der[x] = v
    m.der[v] = z - k * x - 0.5 * v + u
    m.next[z] = 0.9 * z - 0.2 * v + 3 * u
    m.sampled_output("seen", x + u, "m", "Position at the last tick")
    m.output("power", z * v + 7.0 * u, "W", "Power")
    return m


def van_der_pol() -> Model:
    """Nonlinear and not stiff: rk4."""
    m = Model("VanDerPol", "Van der Pol oscillator")
    mu = m.parameter("mu", 1.0, "1", "Damping")
    x = m.state("x", "1", "Displacement", start=2.0)
    v = m.state("v", "1/s", "Rate")
    u = m.input("u", "1/s2", "Drive")
    m.der[x] = v
    m.der[v] = mu * (1 - x**2) * v - x + u
    m.output("y", x, "1", "Displacement")
    m.solver = "rk4"
    return m


def gain() -> Model:
    """Feedthrough alone: no state of any kind; the output has a pole."""
    m = Model("Gain", "Feedthrough")
    u = m.input("u", "1", "In")
    m.output("y", 2 * u, "1", "Out")
    m.output("inverse", 1 / u, "1", "Out")
    return m


MODELS: dict[str, Callable[[], Model]] = {
    "mass_on_spring": mass_on_spring,
    "pendulum": pendulum,
    "two_link": two_link,
    "chain": chain,
    "controller": controller,
    "hybrid": hybrid,
    "van_der_pol": van_der_pol,
    "gain": gain,
}


class Instance:
    """One instance behind fmpy's class for its version and interface; variables by name."""

    def __init__(self, sources: Sources, path: Path, version: int, interface: str, *, logging: bool = True, **more):
        kind = {(2, "cs"): FMU2Slave, (2, "me"): FMU2Model, (3, "cs"): FMU3Slave, (3, "me"): FMU3Model}
        self.version, self.interface, self.messages = version, interface, []
        self.variables = sources.variables
        self._references = {v.name: v.reference for v in sources.variables}
        self.fmu = kind[version, interface](
            guid=sources.token,
            unzipDirectory=str(path.parents[2]),
            modelIdentifier=sources.name,
            instanceName="it",
            **({"libraryPath": str(path)} if version == 2 else {}),
        )
        if version == 2:
            callbacks = fmi2CallbackFunctions()
            callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
            self.fmu.instantiate(callbacks=callbacks, loggingOn=logging)
        else:
            self.fmu.instantiate(loggingOn=logging, logMessage=self._log, **more)

    def _log(self, *arguments) -> None:
        category, text = arguments[-2:]
        self.messages.append(f"{category.decode()}: {text.decode()}")

    def references(self, *names: str) -> list[int]:
        return [self._references[name] for name in names]

    def names(self, *roles: str) -> list[str]:
        return [v.name for v in self.variables if v.role.value in roles]

    def initialize(self, time: float = 0.0, stop_time: float | None = None) -> "Instance":
        if self.version == 2:
            self.fmu.setupExperiment(startTime=time, stopTime=stop_time)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=time, stopTime=stop_time)
        self.fmu.exitInitializationMode()
        return self

    def update(self) -> tuple[bool, float]:
        """The event update of Model Exchange: whether there is a next event, and when."""
        info = self.fmu.newDiscreteStates() if self.version == 2 else self.fmu.updateDiscreteStates()
        return bool(info[-2]), info[-1]

    def get(self, *names: str) -> list[float]:
        read = self.fmu.getReal if self.version == 2 else self.fmu.getFloat64
        return list(read(self.references(*names)))

    def set(self, values: dict[str, float]) -> None:
        write = self.fmu.setReal if self.version == 2 else self.fmu.setFloat64
        write(self.references(*values), list(values.values()))

    def move(self, derivatives: dict[str, tuple[float, ...]]) -> None:
        """Set first, or first and second, derivatives of inputs: for the next step in FMI 2, until changed in FMI 3."""
        rows = [(name, k, value) for name, values in derivatives.items() for k, value in enumerate(values, 1)]
        if self.version == 3:
            self.set({f"input_derivative[{order}].{name}": value for name, order, value in rows})
            return
        names, orders, values = zip(*rows, strict=True)
        self.fmu.setRealInputDerivatives(self.references(*names), list(orders), list(values))

    def step(self, time: float, step_size: float, count: int = 1) -> None:
        for k in range(count):
            self.fmu.doStep(time + k * step_size, step_size)

    def forward(self, unknowns: list[str], knowns: list[str], seed) -> list[float]:
        return self.fmu.getDirectionalDerivative(self.references(*unknowns), self.references(*knowns), list(seed))

    def adjoint(self, unknowns: list[str], knowns: list[str], seed) -> list[float]:
        return self.fmu.getAdjointDerivative(
            self.references(*unknowns), self.references(*knowns), list(seed), nSensitivity=len(knowns)
        )

    def output_derivatives(self, *names: str, order: int = 1) -> list[float]:
        read = self.fmu.getRealOutputDerivatives if self.version == 2 else self.fmu.getOutputDerivatives
        return read(self.references(*names), [order] * len(names))

    def state(self):
        return self.fmu.getFMUstate() if self.version == 2 else self.fmu.getFMUState()

    def restore(self, state) -> None:
        (self.fmu.setFMUstate if self.version == 2 else self.fmu.setFMUState)(state)

    def serialize(self, state) -> bytes:
        return (self.fmu.serializeFMUstate if self.version == 2 else self.fmu.serializeFMUState)(state)

    def deserialize(self, content: bytes):
        return (self.fmu.deSerializeFMUstate if self.version == 2 else self.fmu.deserializeFMUState)(content)

    def free_state(self, state) -> None:
        (self.fmu.freeFMUstate if self.version == 2 else self.fmu.freeFMUState)(state)

    @contextlib.contextmanager
    def refused(self, *words: str) -> Iterator[None]:
        """What is called inside fails, and the last message holds all the words."""
        before = len(self.messages)
        with pytest.raises(FMICallException):
            yield
        assert len(self.messages) > before
        for word in words:
            assert word in self.messages[-1]


@pytest.fixture(scope="session")
def compiled(tmp_path_factory) -> Callable[[Model], tuple[Sources, Path]]:
    """Generate and compile a model, once for each token."""
    done: dict[str, tuple[Sources, Path]] = {}

    def run(model: Model) -> tuple[Sources, Path]:
        sources = generate(model)
        if sources.token not in done:
            folder = tmp_path_factory.mktemp(sources.name)
            done[sources.token] = sources, compile_library(sources, folder / "binaries" / fmpy.platform_tuple)
        return done[sources.token]

    return run


@pytest.fixture
def instance(compiled) -> Iterator[Callable[..., Instance]]:
    """`instance("pendulum", 3, "me")`, or of any model: instantiated, freed at the end of the test."""
    made: list[Instance] = []

    def run(model: str | Model, version: int = 2, interface: str = "cs", **more) -> Instance:
        sources, path = compiled(MODELS[model]() if isinstance(model, str) else model)
        made.append(Instance(sources, path, version, interface, **more))
        return made[-1]

    yield run
    for one in made:
        one.fmu.freeInstance()


@pytest.fixture(params=[2, 3])
def version(request) -> int:
    return request.param


@pytest.fixture(params=["me", "cs"])
def interface(request) -> str:
    return request.param


@pytest.fixture(params=list(MODELS))
def model_name(request) -> str:
    return request.param


@pytest.fixture
def start_values(model_name) -> dict[str, np.ndarray]:
    """Start values by argument of the functions of a model."""
    model = MODELS[model_name]()
    kinds = {"x": Kind.STATE, "z": Kind.SAMPLED_STATE, "u": Kind.INPUT, "p": Kind.PARAMETER}
    return {key: np.array([q.start for q in model.of(kind)]) for key, kind in kinds.items()}


@pytest.fixture(scope="session")
def models() -> dict[str, Callable[[], Model]]:
    return MODELS
