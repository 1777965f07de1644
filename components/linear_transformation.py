"""Linear transformations of signals: gain and offset, as a connection carries them between FMUs.

    value[i] = factor[i] signal[i] + offset[i]

without a state and without delay: an output follows its input at once. It converts units (mm to m, degC to K), and is
the linear transformation of a connection of SSP.

Bode plot, signal to value: |factor| at all frequencies, at 0 degrees, or 180 where the factor is negative.
"""

from hfsa.components import Model, ModelError
from hfsa.components._modelling.units import Carried, carried, quotient_unit


def linear_transformation(*, units: list[str] = ["1"], results: list[str] = ["1"]) -> Model:  # noqa: B006 (never changed)
    """Return one linear transformation per signal.

    Args:
        units: unit of each signal, any text.
        results: unit of each value, any text.

    Raises:
        ModelError: no signals, or another number of results than of units.
    """
    if not units or len(units) != len(results):
        raise ModelError(
            f"linear_transformation: {len(units)} units and {len(results)} results, expected as many of one as of the "
            "other, and at least one"
        )
    m = Model("LinearTransformation", "Gain and offset of signals")
    for i, (of_signal, of_value) in enumerate(zip(map(carried, units), map(carried, results), strict=True), 1):
        factor = m.parameter(f"factor[{i}]", 1.0, _quotient(of_value, of_signal), f"Gain of signal {i}")
        offset = m.parameter(f"offset[{i}]", 0.0, of_value, f"Value at signal {i} of zero")
        signal = m.input(f"signal[{i}]", of_signal, f"Signal {i}")
        m.output(f"value[{i}]", factor * signal + offset, of_value, f"Signal {i}, transformed")
    return m


def _quotient(above: str, below: str) -> str:
    """Return the unit of a quotient, as a text that is carried where one of both is."""
    if isinstance(above, Carried) or isinstance(below, Carried):
        return Carried("1" if above == below else f"({above})/({below})")
    return quotient_unit(above, below)
