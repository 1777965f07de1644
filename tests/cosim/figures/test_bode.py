"""Bode plots: measured points on theoretical lines, labelled resonances, units."""

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.text import Text

from hfsa.cosim.figures.bode import bode_figure, save
from hfsa.cosim.results.files import (
    Plan,
    Point,
    ResultsError,
    Signal,
    Status,
    SweepFile,
    SystemRecord,
    Theory,
    read_sweep,
)

DENSE = np.geomspace(1, 50, 2000)
SPARSE = np.array([1.0, 5.0, 20.0, 24.0, 25.0, 30.0, 50.0])


def resonance(f):
    return 1 / (1 - (f / 24.5) ** 2 + 0.02j * f / 24.5)


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
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
        path = tmp_path_factory.mktemp("sweeps") / name
        with SweepFile.create(path, plan, SystemRecord("Shaker", "")) as file:
            for i, source in enumerate(inputs):
                columns = [np.asarray(entries.get((output, source), 0 * frequency)) for output in outputs]
                file.write(
                    Point(i, k, status, np.array([c[k] for c in columns]), message="x") for k in range(len(frequency))
                )
        return read_sweep(path)

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


def legend_of(figure):
    """Return the labels of the one legend of a figure or of a part of it."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


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
    legend = [label.partition(":")[0] for label in legend_of(bode_figure([bode]).subfigs[0])]
    assert legend == ["robot.position[3]", "robot.position[1]"]
    one = axes_of(bode_figure([bode], outputs=[x[0]], inputs=[Y[0]]))
    assert [upper.get_title() for upper, _ in one] == [f"reference.position[3]  {arrow}  robot.position[1]"]
    with pytest.raises(ResultsError, match=r"no file has an output 'robot.positon\[1\]'; did you mean robot.position"):
        bode_figure([bode], outputs=["robot.positon[1]"])


def test_files_of_one_method_are_told_apart(sweep):
    first = sweep("first.h5", "stepped", SPARSE, {(Z, Y): resonance(SPARSE)})
    second = sweep("second.h5", "stepped", SPARSE, {(Z, Y): 2 * resonance(SPARSE)})
    figure = bode_figure([first, second])
    ((upper, _),) = axes_of(figure)
    assert legend_of(figure) == ["stepped sine, co-simulated FMUs, first", "stepped sine, co-simulated FMUs, second"]
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
    figure = bode_figure([replace(line, marks={"test": 25.0, "elsewhere": 99.0})])
    ((upper, lower),) = axes_of(figure)
    found = {c.get_label(): c for c in upper.lines}
    assert list(found["test, 25 Hz"].get_xdata()) == [25.0, 25.0]
    assert not any(label.startswith("elsewhere") for label in found)
    assert sum(list(c.get_xdata()) == [25.0, 25.0] for c in lower.lines) == 1
    assert legend_of(figure) == ["linear theory", "test, 25 Hz"]


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


# Nothing lies on anything else ----------------------------------------------------------------------------------------


def robot(frequency, outputs=6, inputs=6, modes=(13.9, 27.4, 30.8)):
    """Every output responds to every input, with different resonances, as of a robot in a general posture."""
    names = [(f"{kind}[{i}]", unit) for kind, unit in (("rotation", "rad"), ("position", "m")) for i in (1, 2, 3)]
    s, weight = 2j * np.pi * frequency, np.random.default_rng(4).normal(size=(6, 6, len(modes)))
    poles = [1 / (s**2 + 0.04 * np.pi * mode * s + (2 * np.pi * mode) ** 2) for mode in modes]
    return {
        ((f"robot.platform.{o}", out), (f"reference.command.{i}", into)): np.sum(weight[m, n, :, None] * poles, axis=0)
        * (2 * np.pi * 20) ** 2
        for m, (o, out) in enumerate(names[:outputs])
        for n, (i, into) in enumerate(names[:inputs])
    }


def crowded(sweep):
    return [sweep("all.h5", "linear", DENSE, robot(DENSE, 4, 4))]


def measured(sweep):
    points, dense = robot(SPARSE, 6, 2), robot(DENSE, 6, 2)
    theory = np.zeros((len(DENSE), 6, 2), complex)
    for k, response in enumerate(dense.values()):
        theory[:, k // 2, k % 2] = response
    return [replace(sweep("two.h5", "stepped", SPARSE, points), theory=Theory(DENSE, theory))]


def high(sweep):
    frequency = np.geomspace(45, 21e3, 500)
    sensor = [((f"sensor.estimate[{i}]", "m/s2"), (f"sensor.base.acceleration[{i}]", "m/s2")) for i in (1, 2)]
    one = sweep("high.h5", "linear", frequency, {pair: resonance(frequency / 240) for pair in sensor})
    return [replace(one, marks={f"published: by method {i}": 5800.0 + 90 * i for i in range(3)})]


def narrow(sweep):
    frequency = np.linspace(23, 26, 300)
    return [sweep("narrow.h5", "linear", frequency, {(Z, Y): resonance(frequency)})]


def single(sweep):
    return [sweep("single.h5", "stepped", np.array([24.0]), {(Z, Y): np.array([3.0 + 1j])})]


def modules(count):
    """Many modules of one machine, the first the stiffest, respond to one input."""
    pairs = {((f"machine.module[{k}].sensor.displacement", "m"), ("shaker.force", "N")): k for k in range(1, count + 1)}
    return {pair: resonance(DENSE * (0.6 + 0.01 * k)) * 1e-6 * k for pair, k in pairs.items()}


def listed(sweep):
    return [sweep("listed.h5", "linear", DENSE, modules(14))]


def countless(sweep):
    return [sweep("countless.h5", "linear", DENSE, modules(70))]


@pytest.fixture(scope="module")
def draw(sweep):
    """Draw a case once, which fixes the layout."""

    @cache
    def figure(case):
        made = bode_figure(case(sweep))
        made.canvas.draw()
        return made

    return figure


@pytest.fixture(params=[crowded, measured, listed, countless, high, narrow, single], ids=lambda case: case.__name__)
def drawn(draw, request):
    return draw(request.param)


def boxes(figure):
    """Return box and text of every visible label, without ticks beyond the ends of an axis."""
    beyond = {
        label
        for axes in figure.findobj(Axes)
        for axis in (axes.xaxis, axes.yaxis)
        for tick in (*axis.majorTicks, *axis.minorTicks)
        for label in (tick.label1, tick.label2)
        if not axis.get_view_interval()[0] <= tick.get_loc() <= axis.get_view_interval()[1]
    }
    seen = [t for t in figure.findobj(Text) if t.get_visible() and t.get_text().strip() and t not in beyond]
    return [(t.get_text(), t.get_window_extent()) for t in seen]


def test_no_text_lies_on_another_or_leaves_the_figure(drawn):
    figure, placed = drawn, boxes(drawn)
    assert len(placed) > 8
    for words, box in placed:
        assert figure.bbox.x0 - 1 <= box.x0 <= box.x1 <= figure.bbox.x1 + 1, words
        assert figure.bbox.y0 - 1 <= box.y0 <= box.y1 <= figure.bbox.y1 + 1, words
    for (one, a), (other, b) in combinations(placed, 2):
        assert not a.padded(-1).overlaps(b.padded(-1)), (one, other)


def test_curves_run_through_no_legend_and_no_label_of_a_peak(drawn):
    legends = [legend.get_window_extent() for part in (drawn, *drawn.subfigs) for legend in part.legends]
    assert legends
    for upper, lower in axes_of(drawn):
        assert not any(box.overlaps(axes.get_window_extent()) for box in legends for axes in (upper, lower))
        labels = [text.get_window_extent() for text in upper.texts]
        for line in (line for line in upper.lines if np.ptp(line.get_xdata()) > 0):
            # every pixel of it, not the points that it is drawn through
            x, y = upper.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()])).T
            along = np.linspace(0, len(x) - 1, 40 * len(x))
            x, y = (np.interp(along, np.arange(len(x)), each) for each in (x, y))
            for box in labels:
                assert not np.any((box.x0 < x) & (x < box.x1) & (box.y0 < y) & (y < box.y1))


def test_frequencies_stand_along_the_axes_at_the_bottom_of_every_column(drawn):
    columns = {round(lower.get_window_extent().x0) for _, lower in axes_of(drawn)}
    below = [lower for _, lower in axes_of(drawn) if lower.get_xlabel()]
    assert {round(lower.get_window_extent().x0) for lower in below} == columns
    for lower in below:
        low, high = lower.get_xlim()
        ticks = [tick for tick in lower.get_xticks() if low <= tick <= high]
        assert len(ticks) >= 2
        assert [text.get_text() for text in lower.get_xticklabels()] == [f"{tick:g}" for tick in ticks]


def test_many_responses_have_a_panel_each_and_their_highest_peak_a_label(draw):
    figure = draw(crowded)
    panels = axes_of(figure)
    assert len(panels) == 16
    assert legend_of(figure) == ["linear theory"]
    headings = {text.get_text().replace("\n", "") for text in figure.findobj(Text)}
    moved = ("rotation[1]", "rotation[2]", "rotation[3]", "position[1]")
    assert {f"{end}.{name}" for end in ("robot.platform", "reference.command") for name in moved} <= headings
    for upper, _ in panels:
        (curve,) = (line for line in upper.lines if np.ptp(line.get_xdata()) > 0)
        peak = curve.get_xdata()[np.argmax(curve.get_ydata())]
        named = [float(text.partition(" Hz")[0]) for text in texts(upper)]
        assert min(abs(f / peak - 1) for f in named) < 0.01


def test_small_panels_share_their_axes(draw):
    panels = axes_of(draw(crowded))
    rows = [panels[4 * j : 4 * j + 4] for j in range(4)]
    assert len({lower.get_xlim() for _, lower in panels}) == 1
    for row in rows:
        assert len({lower.get_ylim() for _, lower in row}) == 1
    # three rotations over three rotations, the position over the position, and both over each other
    same, other = rows[0][0][0].get_ylim(), rows[0][3][0].get_ylim()
    assert [upper.get_ylim() for upper, _ in rows[1]] == [same, same, same, other]
    assert rows[3][3][0].get_ylim() == same
    labelled = [[bool(upper.get_ylabel()) for upper, _ in row] for row in rows]
    assert labelled == [[True, False, False, True]] * 4


def test_responses_to_one_input_follow_each_other_row_by_row(draw):
    figure = draw(listed)
    assert [upper.get_title() for upper, _ in axes_of(figure)] == [
        f"machine.module[{k}].sensor.displacement" for k in range(1, 15)
    ]
    assert "shaker.force  \N{RIGHTWARDS ARROW}" in {text.get_text() for text in figure.findobj(Text)}


def test_of_countless_responses_the_largest_are_named_and_the_others_faint(draw):
    figure = draw(countless)
    ((upper, _),) = axes_of(figure)
    assert sorted(legend_of(figure)) == [
        "65 smaller responses",
        *(f"machine.module[{k}].sensor.displacement: linear theory" for k in range(66, 71)),
    ]
    curves = [line for line in upper.lines if np.ptp(line.get_xdata()) > 0]
    faint = [line for line in curves if line.get_label() == "65 smaller responses"]
    assert len(curves) == 70
    assert len(faint) == 65
    assert max(line.get_zorder() for line in faint) < min(line.get_zorder() for line in curves if line not in faint)
    assert max(line.get_ydata().max() for line in faint) < min(
        line.get_ydata().max() for line in curves if line not in faint
    )
