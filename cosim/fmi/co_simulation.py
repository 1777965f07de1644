"""Instance of an FMU in Co-Simulation, FMI 2 or 3.

    fmu = Fmu.load("SDelta.fmi3.fmu")                  # unzipped once per process, removed at its end
    robot = Instance(fmu, "robot")
    robot.enter(0.0, 1.0, {"damping_ratio": 0.01})     # reset if it has run, set values, enter initialization mode
    robot.exit()
    pose = robot.handle(["platform.position[3]"])      # value references and an array for the values
    robot.step(0.0, 1e-3)
    robot.get(pose)                                    # -> pose.values, the same array at every call
    robot.close()

A stepping loop prepares its calls once, `robot.getter(pose)`, `robot.setter(...)`, `robot.stepper(time, size)`, and
runs them in every step: all arguments of a `Call` are ctypes objects, so that a loop in C uses the same function
pointers, value references and arrays.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from ctypes import c_double, c_int, c_void_p
from pathlib import Path
from typing import ClassVar, Self, TypeVar

import numpy as np

from hfsa.cosim.fmi.base_instance import BaseInstance, Call
from hfsa.cosim.fmi.co_simulation_library import CoSimulationLibrary
from hfsa.cosim.fmi.description import SAMPLE_TIME, Interface
from hfsa.cosim.fmi.fmu import Fmu
from hfsa.cosim.fmi.handle import Handle, State
from hfsa.cosim.fmi.step_error import StepError

__all__ = ["Call", "Fmu", "Handle", "Instance", "Instances", "Number", "State", "StepError", "open_instances"]

InstanceType = TypeVar("InstanceType", bound=BaseInstance)

Number = c_double
"""A number that prepared calls read whenever they run: its `value`."""


class Instance(BaseInstance):
    """Co-Simulation instance."""

    interface: ClassVar[Interface] = "co_simulation"
    _library: CoSimulationLibrary

    def step(self, time: float, step_size: float) -> None:
        """Step from `time` over `step_size` [s]; `StepError` where the step fails."""
        self.time = time
        call = self.stepper(Number(time), Number(step_size))
        self.check(call, call.run())

    def stepper(self, time: Number, step_size: Number, is_final: bool = True) -> Call:
        """Return the prepared call of `step`; it steps from the value of `time` at the time of the call.

        `is_final` means that no state from before the step will be restored.
        """
        function = self._functions["step"]
        arguments, run = self._library.step(function, self._component, time, step_size, is_final)
        return Call(self, "step", function, arguments, run)

    def has_input_derivatives(self, inputs: Iterable[str], order: int) -> bool:
        """Whether `derivative_setter` can set time derivatives of an order of these inputs."""
        return all(self.fmu.description.input_derivative(name, order) for name in inputs)

    def derivative_setter(self, handle: Handle, order: int) -> Call:
        """Return the prepared call that sets time derivatives of the handle's inputs from the handle's array, (n,).

        In FMI 2 they are valid for the next step only, in FMI 3 until they are set again. `StructureError` for an input
        without such a derivative.
        """
        targets = [self.fmu.description.input_derivative(name, order) for name in handle.names]
        if None in targets:
            name = handle.names[targets.index(None)]
            raise self._unsupported(
                f"input derivatives of order {order} of {name}", f"canInterpolateInputs or input_derivative[{order}]"
            )
        arguments = self.handle(filter(None, targets), handle.values).arguments
        orders = (c_int * len(targets))(*[order] * len(targets))
        return self._call_of("input_derivatives", *self._library.input_derivatives(arguments, orders))

    def output_derivatives(self, handle: Handle, order: int = 1) -> np.ndarray:
        """Return the time derivatives of outputs after a step, shape (n,)."""
        if self.fmu.description.output_derivative_order < order:
            raise self._unsupported(f"output derivatives of order {order}", "maxOutputDerivativeOrder")
        n = len(handle.names)
        orders, values = (c_int * n)(*[order] * n), np.zeros(n)
        pointer = values.ctypes.data_as(c_void_p)
        self._call("output_derivatives", *self._library.derivatives(handle.arguments, orders, pointer))
        return values

    def values_after_tick(self, names: Sequence[str]) -> np.ndarray:
        """Return sampled states and outputs after a tick, (n,), in initialization mode; the instance is unchanged."""
        handle = self.handle(names)
        before, time = self.save(), self.time or 0.0
        try:
            self.exit()
            # a first step shorter than the sample time has one tick, at its beginning
            self.step(time, self.get(self.handle([SAMPLE_TIME]))[0] / 2)
            return self.get(handle).copy()
        finally:
            self.restore(before)
            self.release(before)


class Instances(dict[str, InstanceType]):
    """Instances by component name; `close`, or the end of a `with`, frees them all."""

    def close(self) -> None:
        """Free the instances."""
        for instance in self.values():
            instance.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def open_instances(
    files: Mapping[str, str | Path],
    kind: type[InstanceType] = Instance,
    isolated: Collection[str] = (),
    isolation: Path | None = None,
) -> Instances[InstanceType]:
    """Load FMUs and return one instance of each; where one fails, the others are closed.

    The instances of the `isolated` components have processes of their own, by the library `isolation`.
    """
    instances: Instances[InstanceType] = Instances()
    try:
        for name, file in files.items():
            library = isolation if name in isolated else None
            instances[name] = kind(Fmu.load(file, kind.interface, library), name)
    except BaseException:
        instances.close()
        raise
    return instances
