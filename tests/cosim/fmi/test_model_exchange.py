"""Model Exchange instance: modes, states, derivatives, ticks as time events, missing capabilities."""

import math
from ctypes import c_double

import numpy as np
import pytest

from hfsa.cosim.fmi.co_simulation import Fmu, StepError, open_instances
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.systems.errors import StructureError

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@pytest.fixture
def exchange():
    """Make instances that are closed after the test."""
    opened = []

    def make(file, name="it") -> ModelExchangeInstance:
        opened.append(ModelExchangeInstance(Fmu.load(file, "model_exchange"), name))
        return opened[-1]

    yield make
    for instance in opened:
        instance.close()


def ready(instance: ModelExchangeInstance, time: float = 0.0, **values: float) -> ModelExchangeInstance:
    """Bring an instance to continuous-time mode."""
    instance.start(time, None, values)
    instance.update()
    instance.continuous_time_mode()
    return instance


@VERSIONS
def test_derivatives_follow_time_states_and_inputs(files, exchange, version):
    plant = ready(exchange(files["Plant", version]), force=3.0)
    assert plant.size == 2
    assert plant.nominals().tolist() == [1.0, 1.0]
    x, rates = np.array([0.5, -2.0]), np.zeros(2)
    put, get = plant.state_setter(x), plant.rate_getter(rates)
    assert put.run() == get.run() == 0
    assert rates.tolist() == [-2.0, 3.0 - 0.5 * -2.0 - 100.0 * 0.5]
    assert plant.states().tolist() == x.tolist()
    x[:] = [0.25, 1.0]
    plant.set(plant.handle(["force"]), [4.0])
    assert put.run() == get.run() == 0
    assert rates.tolist() == [1.0, 4.0 - 0.5 - 25.0]
    assert plant.get(plant.handle(["acceleration"]))[0] == rates[1]
    np.testing.assert_array_equal(plant.jacobian(["der(x)", "der(v)"], ["x", "v"]), [[0, 1], [-100, -0.5]])


@VERSIONS
def test_ticks_are_time_events(files, exchange, version):
    controller = exchange(files["SampledPd", version])
    controller.start(0.25, None, {"position": 1.0})
    force = controller.handle(["force"])
    assert controller.get(force)[0] == 0.0  # the tick at the start has not been
    assert controller.update() == pytest.approx(0.26, abs=1e-15)
    assert controller.get(force)[0] == -(40.0 + 2.0 / 0.01)
    controller.continuous_time_mode()
    controller.set(controller.handle(["position"]), [2.0])
    assert controller.get(force)[0] == -(40.0 + 2.0 / 0.01)  # held until the next
    controller.event_mode()
    time = c_double(0.26)
    assert controller.time_setter(time).run() == 0
    assert controller.update() == pytest.approx(0.27, abs=1e-15)
    assert controller.get(force)[0] == -(80.0 + 2.0 * (2.0 - 1.0) / 0.01)


@VERSIONS
def test_without_ticks_there_is_no_event(files, exchange, version):
    plant = exchange(files["Plant", version])
    plant.start()
    assert plant.update() == math.inf
    assert not plant.complete_step()


@VERSIONS
def test_a_wrong_mode_is_a_step_error(files, exchange, version):
    plant = exchange(files["Plant", version], "body")
    plant.start(0.5)
    with pytest.raises(StepError, match=r"body: fmi\dEnterEventMode: error at t = 0\.5 s: .*event mode") as caught:
        plant.event_mode()
    assert caught.value.status == "error"
    ready(plant)  # and it runs again after a reset


@VERSIONS
def test_a_state_that_is_not_a_number(files, exchange, version):
    plant = ready(exchange(files["Plant", version], "body"))
    x, rates = np.array([np.nan, 0.0]), np.zeros(2)
    assert plant.state_setter(x).run() == 0
    get = plant.rate_getter(rates)
    with pytest.raises(StepError, match=r"body: fmi\dGet.*Derivatives: discard.*der\(v\) is nan"):
        plant.check(get, get.run())


@VERSIONS
def test_both_interfaces_of_one_file(files, exchange, opened, version):
    both = opened({"plant": files["Plant", version]})["plant"], exchange(files["Plant", version])
    assert both[0].fmu.variables == both[1].fmu.variables
    with pytest.raises(StructureError, match="is loaded for co_simulation, expected model_exchange"):
        ModelExchangeInstance(both[0].fmu, "it")


@VERSIONS
def test_an_fmu_without_model_exchange(foreign, version):
    with pytest.raises(StructureError, match="no Model Exchange interface, which the monolithic algorithms use"):
        open_instances({"it": foreign[version]}, ModelExchangeInstance)


def test_arrays_of_the_wrong_size(files, exchange):
    plant = ready(exchange(files["Plant", 2], "body"))
    with pytest.raises(ValueError, match=r"states of body must be a contiguous float64 array of shape \(2,\)"):
        plant.state_setter(np.zeros(3))
