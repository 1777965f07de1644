"""Effect of communication steps, computed before a run: hidden growth, and errors of responses."""

import contextlib

import numpy as np
import pytest
from algorithm_groups import EXTRAPOLATED, HELD, ITERATED
from linear_parts import held_law, linear, random_ring

from hfsa.components.lock_in import lock_in
from hfsa.components.sine_source import sine_source
from hfsa.cosim.analysis.algorithm_choice import choose, warnings
from hfsa.cosim.analysis.step_effect import StepAnalysis, entering, motions
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.linear.cycle import Source
from hfsa.cosim.measurement.rig import Bench, Rig, Settings, Task
from hfsa.cosim.systems.system import Component, Connection, System

SAYS = "the system itself is unstable"


@pytest.fixture(scope="module")
def fmus(exported):
    models = {"linear": linear(), "law": held_law(), "source": sine_source(unit="1/s"), "lock_in": lock_in()}
    return {name: exported(model)[2] for name, model in models.items()}


def analysis_of(ring, opened, fmus):
    """The analysis of a ring's stability."""
    return StepAnalysis(ring.system(), opened(ring.files(fmus["linear"], fmus["law"])), [], ["part[1].y"], (0.1, 10.0))


@pytest.mark.slow
def test_growth_that_steps_hide_is_told_of_every_random_system_and_of_no_other(opened, fmus, monkeypatch):
    # the sample time that would do takes seconds more
    monkeypatch.setattr("hfsa.cosim.analysis.algorithm_choice.sampling_limit", lambda *_: None)
    rng, hidden, others = np.random.default_rng(7), 0, 0
    while hidden < 200 or others < 100:
        neutral, step = random_ring(rng, 0.0)
        gained = neutral.stepped_growth(step)  # what the steps add to the growth
        ring = neutral.shifted(-gained * float(rng.uniform(-0.5, 1.5)))
        own, stepped = ring.growth(), ring.stepped_growth(step)
        hides_instability = own > 0 > stepped
        if min(abs(own), abs(stepped)) < 0.02 or (hidden >= 200 if hides_instability else others >= 100):
            continue
        hidden, others = hidden + hides_instability, others + (not hides_instability)
        analysis = analysis_of(ring, opened, fmus)
        effect = analysis.effect("gauss_seidel", step)
        assert analysis.coupled.exact.growth.rate == pytest.approx(max(own, 0.0), rel=1e-6)
        assert effect.growth == pytest.approx(stepped, rel=1e-6, abs=1e-6)
        assert effect.hides_instability == hides_instability
        assert effect.causes_instability == (own < 0 < stepped)
        sentences = warnings(analysis, effect, tolerance=np.inf)
        assert any(SAYS in sentence for sentence in sentences) == (own > 0)
        assert any("hides" in sentence for sentence in sentences) == hides_instability
        for instance in analysis.instances.values():
            instance.close()


def test_auto_takes_no_algorithm_that_hides_growth(opened, fmus):
    rng, found = np.random.default_rng(11), 0
    while found < 10:
        neutral, step = random_ring(rng, 0.0)
        ring = neutral.shifted(-neutral.stepped_growth(step) / 2)
        if ring.growth() > 0.02 and ring.stepped_growth(step) < -0.02:
            analysis = analysis_of(ring, opened, fmus)
            choice = choose(analysis, step, 1e-3)
            assert choice.errors["gauss_seidel"] == np.inf
            if np.isfinite(choice.error):
                assert not analysis.effect(choice.algorithm, step).hides_instability
            found += 1


def instrumented(ring, step):
    """A ring whose first part is excited by a sine, with a lock-in amplifier at its output."""
    inner = ring.system()
    source = Component("source", "sine_source", None, {"unit": "1/s"})
    listening = Component("lock_in", "lock_in", start={"sample_time": step})
    connections = [
        *inner.connections,
        Connection("source.value", "part[1].push"),
        *(Connection(f"source.{port}", f"lock_in.{port}") for port in ("sine", "cosine")),
        Connection("part[1].y", "lock_in.signal[1]"),
    ]
    return System([source, *inner.components, listening], connections)


def drawn(rng, opened, fmus):
    """A random system, algorithm, step and frequency at which all settles: (system, files, analysis, ...)."""
    while True:
        ring, step = random_ring(rng, -float(10 ** rng.uniform(0.3, 1.3)))
        algorithm = str(rng.choice([*HELD, *EXTRAPOLATED, *ITERATED]))
        frequency = float(10 ** rng.uniform(-2.5, -1.1)) / step
        if ring.stepped_growth(step) > -0.2:
            continue
        system = instrumented(ring, step)
        files = {**ring.files(fmus["linear"], fmus["law"]), "source": fmus["source"], "lock_in": fmus["lock_in"]}
        instances, inner = opened(files), ring.system()
        plain = {c.name: instances[c.name] for c in inner.components}
        excitation = entering("part[1].push", "1/s", 1.0, system, instances, Source("source"), "lock_in")
        analysis = StepAnalysis(inner, plain, [excitation], ["part[1].y"], (frequency / 2, frequency * 2))
        effect = analysis.effect(algorithm, step)
        if not effect.causes_instability and effect.growth < -0.05:
            return system, files, analysis, algorithm, step, frequency


@pytest.mark.parametrize("seed", range(50))
def test_the_predicted_error_of_a_response_is_the_measured_one(opened, fmus, library, seed):
    """Of random stable systems, algorithms and frequencies: within a tenth of each other, or 1e-6."""
    system, files, analysis, algorithm, step, frequency = drawn(np.random.default_rng(seed), opened, fmus)
    at = np.array([frequency])
    predicted, exact = analysis.errors(algorithm, step, at)[0, 0, 0], analysis.exact(at)[0, 0, 0]
    bench = Bench(Assembly.read(system, files), ("part[1].y",), library=library)
    settings = Settings("stepped", algorithm, step, settling_tolerance=1e-8, settling_time=400.0)
    with contextlib.closing(Rig(bench, settings)) as rig:
        point = rig.measure(Task(0, 0, bench, settings, frequency, 1.0))
    measured = abs(point.response[0] - exact) / abs(exact)
    assert predicted == pytest.approx(measured, rel=0.1, abs=1e-6)


def test_a_reference_is_excited_where_nothing_feeds_it(opened, exported):
    """A sine source that drives a system by itself is one motion with its derivatives."""
    files = {"source": exported(sine_source(unit="1/s"))[2], "part[1]": exported(linear())[2]}
    system = System(
        [Component("source", "sine_source", None, {"unit": "1/s"}), Component("part[1]", "linear")],
        [Connection("source.value", "part[1].push"), Connection("source.rate", "part[1].u")],
    )
    (found,) = motions(system, opened(files))
    assert found.source == Source("source", {"value": 0, "rate": 1})
    assert sorted(found.enters) == [("part[1].push", 0), ("part[1].u", 1)]
