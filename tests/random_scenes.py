"""Random scenes of the shipped kinds, each a name and arguments, with one input and a tolerance, by seed."""

import numpy as np

COUNT = 50


def random_scene(seed: int) -> tuple[str, dict[str, str], str, float]:
    """Return scene, arguments, input and tolerance of a seed."""
    draw = np.random.default_rng(seed)
    kinds = (_mass, _shaker, _robot, _stage, _accelerometer, _beams)
    name, arguments, excited = kinds[seed % len(kinds)](draw)
    return name, arguments, excited, float(f"{10 ** draw.uniform(-4, -2):.2g}")


def _number(draw: np.random.Generator, low: float, high: float) -> str:
    """Return a number between two others, evenly on a logarithmic axis."""
    return f"{np.exp(draw.uniform(np.log(low), np.log(high))):.3g}"


def _mass(draw):
    return "mass_on_spring", {"damping": _number(draw, 0.5, 50)}, "mass.base.position"


def _posture(draw) -> str:
    return ",".join(f"{angle:.2f}" for angle in draw.uniform(-5, 5, 3))


def _shaker(draw):
    arguments = {"damping": _number(draw, 3e-3, 0.3), "posture.rotation": _posture(draw)}
    arguments["stiffness"] = str(draw.choice(["ch3_full", "ch4"]))
    return "sdelta_shaker", arguments, f"reference.command.position[{draw.integers(1, 4)}]"


def _robot(draw):
    arguments = {
        "law": str(draw.choice(["pd", "ctc", "ctc_cartesian"])),
        "bandwidth": _number(draw, 3, 9),
        "sample_time": str(draw.choice(["0.1e-3", "0.25e-3", "0.5e-3"])),
        "posture.rotation": _posture(draw),
    }
    return "sdelta_hfsa", arguments, f"reference.command.position[{draw.integers(1, 4)}]"


def _stage(draw):
    arguments = {"bias": _number(draw, 40, 110), "resistance": _number(draw, 20, 100)}
    return "stage_bode", arguments, f"stack[{draw.integers(1, 4)}].command.voltage"


def _accelerometer(draw):
    arguments = {"design": str(draw.choice(["mems", "optimum", "rapid_prototype"])), "angle": _number(draw, 1, 60)}
    return "accelerometer_shaker", arguments, f"sensor.base.acceleration[{draw.integers(1, 3)}]"


def _beams(draw):
    arguments = {"suspension": str(draw.choice(["merged", "massless"])), "damping_ratio": _number(draw, 3e-3, 0.1)}
    return "beam_payload", arguments, f"payload.base.acceleration[{draw.integers(1, 4)}]"
