"""Command lines for tests: a sweep of the example scene, a scene with its own motion, and strict JSON."""

import json

MASS = ["sweep", "mass_on_spring", "-p", "damping=5", "--from", "5", "--to", "50"]
SWEEP, LINEAR = [*MASS, "--jobs", "1"], [*MASS, "--method", "linear"]

OWN_MOTION = """
inputs = []
outputs = ["mass.position"]
step_size = 1e-4
stop_time = 0.5

[[components]]
name = "shaker"
part = "sine_source"
arguments = { unit = "m" }
start = { frequency = 4.0, amplitude = 1e-3 }

[[components]]
name = "mass"
part = "mass_on_spring"

[[components]]
name = "other"
part = "mass_on_spring"

[[connections]]
start = "shaker.value"
end = "mass.base.position"
"""


def strict_json(text):
    """Parse standard JSON, without NaN and Infinity."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)
