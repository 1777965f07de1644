"""The pictures of the site, made by the commands that its pages name.

    make pictures                              # all
    python docs/pictures.py stability one-step # some

Each function makes one file in `docs/pictures`, which is committed: a build of the site runs no simulation.
"""

import doctest
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from hfsa.cosim.cli import main as hfsa
from hfsa.cosim.figures.style import STYLE

PAGES = Path(__file__).parent
PICTURES = PAGES / "pictures"

WIDEST = 1280
"""Width of a picture at most [px]."""


def demo(file: Path, work: Path) -> None:
    """Vertical axis of the robot, alone and under control: the commands of `make demo`."""
    vertical = "--input command.position[3] --signal platform.position[3] --from 1 --to 50 --points 40"
    run(f"sweep sdelta_shaker {vertical} -o {work}/demo.h5")
    run(f"sweep sdelta_hfsa {vertical} -o {work}/demo_hfsa.h5")
    run(f"bode {work}/demo.h5 {work}/demo_hfsa.h5 -o {file}")


def compare(file: Path, _work: Path) -> None:
    """The piezo stage under four control laws."""
    run(f"compare stage_tracking --over law=pd,pd_ff,ctc,integral_ff -p motion=three_axis -o {file}")


def stage_continuum(file: Path, _work: Path) -> None:
    """The piezo stage by finite elements: its mesh, its deformation and the stress in it."""
    run(f"analyze rrr_stage --level continuum --mesh 0.2e-3 -p elongation=12e-6,12e-6,0 --picture {file}")


def stability(file: Path, work: Path) -> None:
    """Where the robot under delayed PD control is stable."""
    vary = "--vary bandwidth=2:60:24 --vary sample_time=0.25e-3:2e-3:8"
    run(f"stability sdelta_hfsa -p delay=true --step 0.25e-3 {vary} -o {work}/stability.h5")
    shutil.copyfile(work / "stability.png", file)


def workspace(file: Path, work: Path) -> None:
    """Frequency, indices and condition number of the robot over horizontal positions."""
    plane = "posture.position[1]=-0.09:0.09,posture.position[2]=-0.09:0.09"
    run(f"analyze sdelta --map {plane} -o {work}/workspace.h5")
    shutil.copyfile(work / "workspace.png", file)


def beams(file: Path, _work: Path) -> None:
    """Three tilted beams, the axes of their freedoms, and their motions."""
    run(f"analyze beam_module -p kind=tilted --picture {file}")


def robot(file: Path, _work: Path) -> None:
    """The robot at a posture, its compliant axes and its eigenscrews."""
    run(f"view sdelta -p posture.rotation=10,5,8 --show posture,compliant_axes,eigenscrews -o {file}")


def modes(file: Path, _work: Path) -> None:
    """The modes of the robot at a posture."""
    run(f"view sdelta -p posture.rotation=10,5,8 --show modes -o {file}")


def modal_screws(file: Path, _work: Path) -> None:
    """The modal screws of the robot at the symmetric posture."""
    run(f"view sdelta --show modal_screws -o {file}")


def all_responses(file: Path, work: Path) -> None:
    """All responses of the robot's platform at a posture."""
    run(f"sweep sdelta_shaker -p posture.rotation=10,5,8 --method linear -o {work}/all.h5")
    run(f"bode {work}/all.h5 -o {file}")


def pose_over_elongation(file: Path, work: Path) -> None:
    """Pose of the stage over the elongation of a stack, by models and as measured."""
    over = "--over elongation[2]=0:12e-6:13"
    models = {
        "exact": "--level exact",
        "calibrated": "--level exact -p kinematics=calibrated",
        "measured": "--level jacobian -p kinematics=measured",
        "flexible_hinges": "--level flexible_hinges",
        "continuum": "--level continuum",
    }
    for name, words in models.items():
        run(f"analyze rrr_stage {words} {over} -o {work}/{name}.h5")
    files = " ".join(f"{work}/{name}.h5" for name in models)
    run(f"plot {files} --x elongation[2] --signal pose[1..3] -o {file}")


def sensitivity(file: Path, _work: Path) -> None:
    """Sensitivity of the accelerometer's frequencies to its dimensions."""
    run(f"analyze tba_accelerometer --sensitivity -o {file}")


def diagram(file: Path, _work: Path) -> None:
    """The blocks of the piezo stage under control."""
    run(f"view stage_tracking --diagram -o {file}")


def stage_links(file: Path, _work: Path) -> None:
    """The links of the stage, at rest and moved by a stack."""
    run(f"analyze rrr_stage --picture {file}")


def accelerometer(file: Path, _work: Path) -> None:
    """The accelerometer at home, and displaced along each axis."""
    run(f"analyze tba_accelerometer --picture {file}")


def loop(file: Path, work: Path) -> None:
    """Elongation of hysteretic stacks over their voltage."""
    run(f"run stage_tracking -p motion=three_axis -p stack=hysteretic -p law=integral --every 20 -o {work}/loop.h5")
    signals = "--x stack[1..3].stack.voltage --signal stage.stack[1..3].elongation --from 0.2"
    run(f"plot {work}/loop.h5 {signals} -o {file}")


def one_step(file: Path, _work: Path) -> None:
    """Growth of the worked example's mode, and error of its response, over the communication step."""
    page = (PAGES / "one-step-matrix.md").read_text(encoding="utf-8")
    text = "\n".join(re.findall(r"^```pycon\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    names: dict = {}
    for example in doctest.DocTestParser().get_examples(text):
        if "print(" not in example.source and ".close()" not in example.source:
            exec(example.source, names)
    chosen = ("jacobi_plain", "gauss_seidel", "gauss_seidel_linear", "quasi_newton")
    steps, frequency = np.geomspace(5e-6, 20e-3, 200), 10.0
    exact = names["exact"](frequency)
    with plt.rc_context(STYLE):
        figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8.6, 6.2), layout="constrained")
        for algorithm in chosen:
            coupled = names["shaken"].with_algorithm(algorithm)
            ones = [coupled.over(step) for step in steps]
            above.plot(steps * 1e3, [one.growth() for one in ones], label=algorithm)
            below.plot(steps * 1e3, [100 * abs(one.response([frequency])[0, 0] / exact - 1) for one in ones])
    decay = -names["c"] / (2 * names["m"])
    above.axhline(0.0, color="black", linewidth=0.8)
    above.axhline(decay, color="black", linewidth=0.8, linestyle=":")
    above.annotate("without steps: -c / 2m", (steps[0] * 1e3, decay), (0, -14), textcoords="offset points", fontsize=9)
    above.axvline(2e3 * names["c"] / names["k"], color="grey", linewidth=0.8, linestyle="--")
    above.annotate("2 c / k", (2e3 * names["c"] / names["k"], 0.45), (4, 0), textcoords="offset points", fontsize=9)
    above.set(xscale="log", ylim=(-0.4, 0.6), ylabel="growth of the mode [1/s]")
    below.set(xscale="log", yscale="log", xlabel="communication step [ms]", ylabel="error of the response at 10 Hz [%]")
    below.set_ylim(1e-5, 1e2)
    above.legend(loc="upper left", fontsize=9)
    for axes in (above, below):
        axes.grid(visible=True, alpha=0.3)
    figure.savefig(file, dpi=120)
    for name in ("driven", "instances"):
        names[name].close()
    names["folder"].cleanup()


def work_precision(file: Path, _work: Path) -> None:
    """Error over CPU time of our algorithms and of other masters, on the same FMUs."""
    script = PAGES.parent / "tests" / "benchmarks" / "work_precision.py"
    subprocess.run([sys.executable, script, "-o", file], check=True)


def run(command: str) -> None:
    """Run one command of `hfsa`; an exit code other than 0 ends everything."""
    if code := hfsa(shlex.split(command)):
        sys.exit(code)


def shrink(picture: Path, file: Path) -> None:
    """Write a picture with 256 colours, each close to its own, no wider than `WIDEST`: it is kept in the repository."""
    with Image.open(picture) as image:
        size = (WIDEST, round(image.height * WIDEST / image.width))
        small = image.resize(size, Image.Resampling.LANCZOS) if image.width > WIDEST else image
        plain = small.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        plain.save(file, optimize=True)


MADE = {
    "demo": demo,
    "compare": compare,
    "stage-continuum": stage_continuum,
    "stability": stability,
    "workspace": workspace,
    "beams": beams,
    "robot": robot,
    "diagram": diagram,
    "modes": modes,
    "modal-screws": modal_screws,
    "all-responses": all_responses,
    "pose-over-elongation": pose_over_elongation,
    "sensitivity": sensitivity,
    "stage-links": stage_links,
    "accelerometer": accelerometer,
    "loop": loop,
    "one-step": one_step,
    "work-precision": work_precision,
}
"""Pictures by the name of their file."""


def main(names: list[str]) -> None:
    """Make the pictures of these names, or all."""
    if unknown := set(names) - MADE.keys():
        sys.exit(f"no picture is called {', '.join(sorted(unknown))}; there are {', '.join(MADE)}")
    for name in names or MADE:
        with tempfile.TemporaryDirectory() as work:
            MADE[name](Path(work, "picture.png"), Path(work))
            shrink(Path(work, "picture.png"), PICTURES / f"{name}.png")


if __name__ == "__main__":
    main(sys.argv[1:])
