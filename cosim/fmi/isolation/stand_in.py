"""Library that stands in for an FMU's binary: the same functions, each of which a process of the instance's own makes.

    fmu = StandIn(library, binary)                     # in the place of fmpy's object for a loaded binary
    address = fmu.fmi2Instantiate(...)                 # starts a host process
    fmu.dll["fmi2DoStep"](c_void_p(address), ...)      # as of a binary that is loaded here, also for a loop in C

The exchange of a call and its answer takes one to two microseconds where both processes have a processor.
"""

from collections.abc import Callable
from ctypes import c_bool, c_char_p, c_int, c_size_t, c_void_p
from functools import partial
from pathlib import Path

from hfsa.cosim.fmi.isolation.host import Host, client
from hfsa.cosim.fmi.isolation.waiting import INTERRUPTED, NOT_LOADED, interruption

_TEXTS = [c_char_p, c_char_p, c_char_p]

_ARGUMENTS = {
    "fmi2Instantiate": [c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int],
    "fmi3InstantiateModelExchange": [*_TEXTS, c_bool, c_bool, c_void_p, c_void_p],
    "fmi3InstantiateCoSimulation": [
        *_TEXTS,
        *[c_bool] * 4,
        *[c_void_p, c_size_t],
        *[c_void_p] * 3,
    ],
}
"""Types of the arguments of the functions that instantiate."""


class StandIn:
    """Binary of an FMU whose instances live in processes of their own.

    Attributes:
        dll: functions of FMI by name.
        is_not_loaded: whether the last instantiation failed because the binary cannot be loaded.
        failure: how the process of the last instantiation that failed has ended, empty where it has not.
    """

    def __init__(self, library: Path, binary: Path):
        self.dll = client(library)
        self._library, self._binary = library, binary
        self._hosts: dict[int, Host] = {}
        self.is_not_loaded, self.failure = False, ""

    def __getattr__(self, name: str) -> Callable[..., int | None]:
        """Return the function of FMI that instantiates in a new process; it returns an address, or `None`."""
        if name not in _ARGUMENTS:
            raise AttributeError(name)
        return partial(self._instantiate, name)

    def close(self) -> None:
        """End all processes."""
        for address in list(self._hosts):
            self.end(address)

    def end(self, address: int) -> None:
        """End the process of the instance at an address."""
        self._hosts.pop(address).end(address)

    def ending(self, address: int) -> str:
        """Return how the process of the instance at an address has ended."""
        return self._hosts[address].ending(address)

    def _instantiate(self, name: str, *arguments) -> int | None:
        """Return the address of a new instance, `None` where there is none."""
        host = Host(self._library, self._binary)
        function = self.dll[name]
        function.argtypes, function.restype = _ARGUMENTS[name], c_void_p
        address = function(*arguments)
        self._hosts[address] = host
        found, status = self.dll.hfsa_is_instance(address), self.dll.hfsa_ending(address)
        if found == 1:
            return address
        self.is_not_loaded, self.failure = found == NOT_LOADED, self.ending(address) if status else ""
        self.end(address)
        if status == INTERRUPTED:
            raise interruption()
        return None
