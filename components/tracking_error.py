"""Tracking error of any number of axes: error = reference - measured.

Ports of axis i: in `axis[i].reference` and `axis[i].measured`, out `axis[i].error`, all in one unit. The part has no
state: the error at a communication point is that of the inputs at this point.

Bode plot, reference to error: 1 at all frequencies; measured to error: -1.
"""

from hfsa.components import Model, ModelError


def tracking_error(*, axes: int = 1, unit: str = "m") -> Model:
    """Return the tracking errors of all axes.

    Args:
        axes: number of axes.
        unit: unit of reference, measured value and error.

    Raises:
        ModelError: fewer than one axis; an unknown unit.
    """
    if axes < 1:
        raise ModelError(f"tracking_error: axes is {axes}, expected 1 or more")
    m = Model("TrackingError", "Difference between reference and measured value")
    each = f"axis[1..{axes}]"
    reference = m.input(f"{each}.reference", unit, "Reference")
    measured = m.input(f"{each}.measured", unit, "Measured value")
    m.output(f"{each}.error", reference - measured, unit, "Reference minus measured value")
    return m
