"""A Bode plot shows measured points on theoretical lines, marks resonances, and names its units."""

from dataclasses import replace

import numpy as np
import pytest

from hfsa.cosim.plots import bode_figure, save
from hfsa.cosim.results import Plan, Point, ResultsError, Signal, Status, SweepFile, SystemRecord, Theory, read

DENSE = np.geomspace(1, 50, 2000)
SPARSE = np.array([1.0, 5.0, 20.0, 24.0, 25.0, 30.0, 50.0])


def resonance(f):
    return 1 / (1 - (f / 24.5) ** 2 + 0.02j * f / 24.5)


@pytest.fixture
def sweep(tmp_path):
    """Write a sweep: `entries` maps (output, input), each (name, unit), to a response."""

    def make(name, method, frequency, entries, status=Status.DONE):
        outputs = list(dict.fromkeys(output for output, _ in entries))
        inputs = list(dict.fromkeys(source for _, source in entries))
        plan = Plan(
            np.asarray(frequency, float),
            [Signal(*output) for output in outputs],
            [Signal(*source, 1e-5) for source in inputs],
            {"method": method},
        )
        with SweepFile.create(tmp_path / name, plan, SystemRecord("Shaker", "")) as file:
            for i, source in enumerate(inputs):
                columns = [np.asarray(entries.get((output, source), 0 * frequency)) for output in outputs]
                file.write(
                    Point(i, k, status, np.array([c[k] for c in columns]), message="x") for k in range(len(frequency))
                )
        return read(tmp_path / name)

    return make


Z, Y = ("robot.position[3]", "m"), ("reference.position[3]", "m")


def test_the_theory_in_a_measured_file_is_drawn_as_its_line(sweep):
    points = sweep("swept.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)})
    theory = Theory(DENSE, resonance(DENSE)[:, None, None])
    ((upper, _),) = axes_of(bode_figure([replace(points, theory=theory)]))
    curves = {c.get_label(): c for c in upper.lines if not c.get_label().startswith("_")}
    assert list(curves) == ["linear theory", "stepped sine, co-simulated FMUs"]
    np.testing.assert_allclose(curves["linear theory"].get_ydata(), 20 * np.log10(abs(resonance(DENSE))), atol=1e-9)


def axes_of(figure):
    """Return the pairs of axes, magnitude over phase."""
    axes = [a for part in figure.subfigs for a in part.axes]
    return list(zip(axes[::2], axes[1::2], strict=True))


def texts(axes):
    return [text.get_text() for text in axes.texts]


def test_measured_points_lie_on_the_theoretical_line(sweep):
    line = sweep("theory.h5", "linear", DENSE, {(Z, Y): resonance(DENSE)})
    points = sweep("swept.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)})
    ((upper, lower),) = axes_of(bode_figure([points, line]))
    curves = {c.get_label(): c for c in upper.lines if not c.get_label().startswith("_")}
    assert list(curves) == ["linear theory", "stepped sine, co-simulated FMUs"]
    drawn = curves["stepped sine, co-simulated FMUs"]
    assert drawn.get_marker() == "o"
    assert drawn.get_linestyle() == "None"
    assert np.allclose(drawn.get_xdata(), SPARSE)
    assert np.allclose(drawn.get_ydata(), 20 * np.log10(np.abs(resonance(SPARSE))))
    phase = next(c for c in lower.lines if c.get_marker() == "o").get_ydata()
    assert np.allclose(phase, np.degrees(np.angle(resonance(SPARSE))))
    assert curves["linear theory"].get_color() == drawn.get_color()


def test_the_resonance_is_marked_with_frequency_and_height(sweep):
    line = sweep("theory.h5", "linear", np.geomspace(1, 50, 300), {(Z, Y): resonance(np.geomspace(1, 50, 300))})
    ((upper, _),) = axes_of(bode_figure([line]))
    assert texts(upper) == ["24.5 Hz, 34.0 dB"]  # between the points of the grid


def test_of_close_peaks_the_highest_is_marked(sweep):
    x, far = ("robot.position[1]", "m"), 1 / (1 - (DENSE / 10) ** 2 + 0.02j * DENSE / 10)
    entries = {(Z, Y): resonance(DENSE), (x, Y): 0.2 * resonance(DENSE * 0.99) + far}
    ((upper, _),) = axes_of(bode_figure([sweep("theory.h5", "linear", DENSE, entries)]))
    assert sorted(texts(upper)) == ["24.5 Hz, 34.0 dB", "9.999 Hz, 34.0 dB"]


def test_panels_with_the_same_curves_share_a_legend(sweep):
    r = ("reference.rotation[2]", "rad")
    t = ("robot.rotation[2]", "rad")
    bode = sweep("two.h5", "linear", DENSE, {(Z, Y): resonance(DENSE), (t, r): resonance(DENSE)})
    figure = bode_figure([bode])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["linear theory"]
    assert all(upper.get_legend() is None for upper, _ in axes_of(figure))


def test_a_curve_without_a_peak_has_no_mark(sweep):
    ((upper, _),) = axes_of(bode_figure([sweep("flat.h5", "stepped", SPARSE, {(Z, Y): 1 / (1 + 0.1j * SPARSE)})]))
    assert texts(upper) == []


@pytest.mark.parametrize(
    ("output", "source", "label", "factor"),
    [
        ("m", "m", "Magnitude (dB)", 1),
        ("rad", "m", "Magnitude (dB re 1 deg/mm)", 180 / np.pi / 1e3),
        ("m", "rad", "Magnitude (dB re 1 mm/deg)", 1e3 * np.pi / 180),
        ("m", "N", "Magnitude (dB re 1 um/N)", 1e6),
        ("rad", "N.m", "Magnitude (dB re 1 deg/(N.m))", 180 / np.pi),
        ("N", "m/s", "Magnitude (dB re 1 N/(m/s))", 1),
    ],
)
def test_axes_name_their_units(sweep, output, source, label, factor):
    bode = sweep("one.h5", "linear", SPARSE, {(("a.y", output), ("a.u", source)): np.full(7, 0.5 + 0j)})
    ((upper, lower),) = axes_of(bode_figure([bode]))
    assert upper.get_ylabel() == label
    assert lower.get_ylabel() == "Phase (deg)"
    assert lower.get_xlabel() == "Frequency (Hz)"
    assert np.allclose(upper.lines[0].get_ydata(), 20 * np.log10(0.5 * factor))


def test_entries_share_axes_by_unit_and_zeros_are_left_out(sweep):
    x, t = ("robot.position[1]", "m"), ("robot.rotation[2]", "rad")
    r = ("reference.rotation[2]", "rad")
    h = resonance(SPARSE)
    entries = {(Z, Y): h, (x, Y): 0.1 * h, (t, Y): 1e-17 * h, (t, r): h, (Z, r): 1e-16 * h, (x, r): 0.1 * h}
    bode = sweep("six.h5", "stepped", SPARSE, entries)
    titles = [upper.get_title() for upper, _ in axes_of(bode_figure([bode]))]
    arrow = "\N{RIGHTWARDS ARROW}"
    assert titles == [
        "reference.position[3]",
        f"reference.rotation[2]  {arrow}  robot.rotation[2]",
        f"reference.rotation[2]  {arrow}  robot.position[1]",
    ]
    legend = [text.get_text().partition(":")[0] for text in axes_of(bode_figure([bode]))[0][0].get_legend().get_texts()]
    assert legend == ["robot.position[3]", "robot.position[1]"]
    one = axes_of(bode_figure([bode], outputs=[x[0]], inputs=[Y[0]]))
    assert [upper.get_title() for upper, _ in one] == [f"reference.position[3]  {arrow}  robot.position[1]"]
    with pytest.raises(ResultsError, match=r"no file has an output 'robot.positon\[1\]'; did you mean robot.position"):
        bode_figure([bode], outputs=["robot.positon[1]"])


def test_files_of_one_method_are_told_apart(sweep):
    first = sweep("first.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)})
    second = sweep("second.h5", "stepped", SPARSE, {(Z, Y): 2 * resonance(SPARSE)})
    ((upper, _),) = axes_of(bode_figure([first, second]))
    labels = [text.get_text() for text in upper.get_legend().get_texts()]
    assert labels == ["stepped sine, co-simulated FMUs, first", "stepped sine, co-simulated FMUs, second"]
    assert len({line.get_color() for line in upper.lines if line.get_marker() == "o"}) == 2


def test_points_that_did_not_settle_or_failed_look_different(sweep):
    loose = sweep("loose.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)}, status=Status.NOT_SETTLED)
    ((upper, _),) = axes_of(bode_figure([loose]))
    assert "stepped sine, co-simulated FMUs, not settled" in [line.get_label() for line in upper.lines]
    limited = sweep("limited.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)}, status=Status.LIMITED)
    ((upper, _),) = axes_of(bode_figure([limited]))
    assert "stepped sine, co-simulated FMUs, at a limit" in [line.get_label() for line in upper.lines]
    failed = sweep("failed.h5", "stepped", SPARSE, {(Z, Y): np.full(7, np.nan)}, status=Status.FAILED)
    good = sweep("good.h5", "linear", DENSE, {(Z, Y): resonance(DENSE)})
    with pytest.raises(ResultsError, match=r"failed.h5: no finished points to draw"):
        bode_figure([failed])
    ((_, lower),) = axes_of(bode_figure([good]))
    assert "failed" not in [line.get_label() for line in lower.lines]


def test_a_phase_that_wraps_is_drawn_on_the_branch_of_its_line(sweep):
    delay = np.exp(-2j * np.pi * DENSE * 0.05)
    line = sweep("theory.h5", "linear", DENSE, {(Z, Y): delay})
    points = sweep("swept.h5", "stepped", SPARSE, {(Z, Y): np.exp(-2j * np.pi * SPARSE * 0.05)})
    ((_, lower),) = axes_of(bode_figure([line, points]))
    drawn = next(c for c in lower.lines if c.get_marker() == "o").get_ydata()
    assert np.allclose(drawn, -360 * SPARSE * 0.05)


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_picture_is_written(sweep, tmp_path, suffix):
    path = tmp_path / "new" / f"bode.{suffix}"
    save(bode_figure([sweep("theory.h5", "linear", SPARSE, {(Z, Y): resonance(SPARSE)})]), path)
    assert path.stat().st_size > 5000


def test_a_format_that_is_none_is_an_error(sweep, tmp_path):
    figure = bode_figure([sweep("theory.h5", "linear", SPARSE, {(Z, Y): resonance(SPARSE)})])
    with pytest.raises(ResultsError, match=r"cannot write .*bode.xyz.*png"):
        save(figure, tmp_path / "bode.xyz")


def test_what_others_have_found_is_drawn_as_named_lines(sweep):
    line = sweep("theory.h5", "linear", DENSE, {(Z, Y): resonance(DENSE)})
    ((upper, lower),) = axes_of(bode_figure([replace(line, marks={"test": 25.0, "elsewhere": 99.0})]))
    found = {c.get_label(): c for c in upper.lines}
    assert list(found["test, 25 Hz"].get_xdata()) == [25.0, 25.0]
    assert not any(label.startswith("elsewhere") for label in found)
    assert sum(list(c.get_xdata()) == [25.0, 25.0] for c in lower.lines) == 1
    assert "test, 25 Hz" in [text.get_text() for text in upper.get_legend().get_texts()]


def test_long_names_and_many_labels_stay_within_the_figure(sweep):
    sensor = [(f"sensor.acceleration_estimate[{i}]", "m/s2") for i in (1, 2)]
    base = [(f"sensor.base.acceleration[{i}]", "m/s2") for i in (1, 2)]
    both = sweep("two.h5", "linear", DENSE, {(sensor[i], base[i]): resonance(DENSE) for i in (0, 1)})
    figure = bode_figure([replace(both, marks={f"published: by method {i}": 20.0 + i for i in range(3)})])
    figure.canvas.draw()
    whole = figure.bbox
    for artist in (figure.legends[0], *(upper.title for upper, _ in axes_of(figure))):
        box = artist.get_window_extent()
        assert whole.x0 <= box.x0
        assert box.x1 <= whole.x1
