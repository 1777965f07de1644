"""Plain Jacobi, for comparison with other masters: get all outputs, set all inputs, step all instances."""

from collections.abc import Iterator, Mapping

from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.algorithm import Algorithm, Scheme
from hfsa.cosim.masters.stepped import stepped
from hfsa.cosim.systems.system import System


def exchange_plain(wiring: Wiring) -> Iterator[Action]:
    """Yield the actions of an exchange: fetch all outputs, then set all inputs."""
    yield from wiring.stages()
    for stage in wiring.stages():
        yield from stage.transfers


def jacobi_plain(wiring: Wiring) -> Iterator[Action]:
    """Yield the steps of all instances, sampled or not."""
    yield from wiring.discrete
    yield from wiring.continuous


def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
    """Return the scheme on one system."""
    wiring = Wiring(system, instances)
    return Scheme(wiring, list(jacobi_plain(wiring)), list(exchange_plain(wiring)))


ALGORITHMS = (
    Algorithm(
        "jacobi_plain",
        "all outputs are fetched, all inputs set, all instances step, as in other masters",
        rank=30,
        inputs="held",
        order=1,
        scheme=scheme,
        make=stepped,
    ),
)
