"""Margins of an opened loop, as data for JSON and as text."""

import math
from typing import Any

from hfsa.cosim.experiments.open_loop import OpenLoop


def open_loop_data(found: OpenLoop) -> dict[str, Any]:
    """Return the margins as plain data."""
    margins = found.margins
    return {
        "file": found.path,
        "connection": str(found.connection),
        "is_stable": margins.is_stable,
        "gain_margins": [{"frequency": m.frequency, "factor": m.value} for m in margins.gain],
        "phase_margins": [{"frequency": m.frequency, "phase": m.value} for m in margins.phase],
        "delay_margin": margins.delay,
        "sensitivity": {"peak": margins.sensitivity_peak, "frequency": margins.sensitivity_frequency},
    }


def open_loop_text(found: OpenLoop) -> str:
    """Return the margins as text."""
    margins = found.margins
    gains = [f"{m.value:.6g} ({20 * math.log10(m.value):.4g} dB) at {m.frequency:.6g} Hz" for m in margins.gain]
    phases = [f"{math.degrees(m.value):.4g} degrees at {m.frequency:.6g} Hz" for m in margins.phase]
    delay = f"{margins.delay:.4g} s" if math.isfinite(margins.delay) else "none"
    return "\n".join(
        [
            f"{found.path}: loop gain and sensitivity at {found.connection}",
            f"  the closed loop is {'stable' if margins.is_stable else 'UNSTABLE: its margins mean little'}",
            f"  gain margin    {'; '.join(gains) or 'none: no gain reaches -1'}",
            f"  phase margin   {'; '.join(phases) or 'none: the gain never crosses 1'}",
            f"  delay margin   {delay}",
            f"  sensitivity    {margins.sensitivity_peak:.4g} at most, at {margins.sensitivity_frequency:.6g} Hz",
        ]
    )
