"""Motion files as people write them: spaces, an end that is none, rows beyond reach."""

import pytest

from hfsa.components import ModelError
from hfsa.components._modelling.motion_table import MotionTable
from hfsa.components.pose_table import pose_table
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.cli import main
from hfsa.cosim.scenes._motion import end_of


@pytest.mark.parametrize(
    "text",
    [
        "time,z\n0,0\n0.25,0.001\n",
        "time [s], z [m]\n0, 0\n0.25, 0.02\n",
        "z [m], time [s]\n0, 0\n 0.02 , 0.25\n\n",
        '"time","z"\r\n0,0\r\n0.25,0.001\r\n',
        "\ufefftime,z\n0,0\n0.25,0\n",
    ],
    ids=["plain", "spaces", "time last", "quoted", "byte order mark"],
)
def test_a_run_ends_with_the_table(tmp_path, text):
    (tmp_path / "motion.csv").write_text(text, encoding="utf-8")
    assert end_of(str(tmp_path / "motion.csv")) == 0.25


@pytest.mark.parametrize("last", ["inf", "nan", "0", "-1", "x"])
def test_a_table_without_an_end_is_left_to_its_reader(tmp_path, last):
    (tmp_path / "motion.csv").write_text(f"time,z\n0,0\n{last},0\n")
    assert end_of(str(tmp_path / "motion.csv")) == 1.0
    with pytest.raises(ModelError, match="time"):
        pose_table(table=MotionTable(**MotionTable.table_of(tmp_path / "motion.csv")))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"time": (0.0, 1.0), "z": (0.0, 10.0)}, "row 2: z is 10 m, expected 1 m at most"),
        ({"time": (0.0, 1.0, 2.0), "rotation_x": (0.0, -4.0, 0.0)}, "row 2: rotation_x is -4 rad, expected 3.142 rad"),
    ],
    ids=["position", "rotation"],
)
def test_rows_beyond_reach_are_refused(columns, message):
    with pytest.raises(ModelError, match=message):
        pose_table(table=MotionTable(columns))


def test_the_reach_is_half_a_side_of_the_base(tmp_path):
    (tmp_path / "m.csv").write_text("time,z\n0,0\n1,0.001\n")
    arguments = {"motion": str(tmp_path / "m.csv"), "geometry.base_radius": 0.9}
    assert load_scene("sdelta_shaker", arguments).system["motion"].arguments["reach"] == pytest.approx(0.9 * 3**0.5 / 2)


@pytest.mark.parametrize(
    ("stop", "message"),
    [
        pytest.param("1e9", "is 1e+13 points, of which a file keeps 1e+09 at most", id="more points than a file keeps"),
        pytest.param("1e12", "make more than 9.0072e+15 steps, expected fewer", id="more steps than are counted"),
    ],
)
def test_an_end_that_no_file_can_hold_is_refused(stop, message, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "mass_on_spring", "--stop", stop]) == 2
    assert message in capsys.readouterr().err
