"""A scene as a system structure package that other tools run: the system that `run` would step, with its source.

found = package("sdelta_hfsa", frequency=20.0, path="sdelta_hfsa.ssp")
found.file, found.elements      # {"drive[1]": "drive_1", ...}
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.fmu_cache import fmu_with_starts
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.assembly.packages import PACKAGE
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.run import SineInput, ready_to_step, with_sine
from hfsa.cosim.experiments.setup import Warn, default_path, set_up, with_levels
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.results.target import check_package, os_refusal
from hfsa.cosim.ssp.write import write
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import legible
from hfsa.cosim.systems.scene import Scene
from hfsa.fmus._platforms import platforms_named, remark


@dataclass(frozen=True)
class Package:
    """A package that has been written: its file, and the name of each component's element in it."""

    file: Path
    elements: Mapping[str, str]


@checked(zero=("amplitude",))
def package(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    input: str | None = None,  # noqa: A002 (name of the public argument)
    frequency: float | None = None,
    amplitude: float | None = None,
    step_size: float | None = None,
    stop_time: float | None = None,
    algorithm: str | None = None,
    fuse: Sequence[str] = (),
    fmi: int = 2,
    platforms: Sequence[str] = ("here",),
    path: str | Path | None = None,
    warn: Warn = warnings.warn,
) -> Package:
    """Write a scene as a system structure package (SSP 1.0), with a sine source at an input where the scene has inputs.

    FMUs have the scene's start values in them and beside them, so that a tool that reads no parameter sets runs the
    same system. Levels `auto` are chosen as in a run. Arguments that are not listed are those of `run`.

    Args:
        amplitude: amplitude of the sine in the unit of the input, 0 for a package without a source (default: the
            scene's).
        step_size, algorithm: communication step size [s] and algorithm that the package names (default: the scene's).
        fmi: version of FMI, 2 or 3.
        platforms: platforms of the binaries, `here`, `all` or names, as of the verb `export`; foreign FMUs are as they
            are.
        path: file of the package (default: `SCENE.ssp` in the working folder); an SSP of that name is replaced.

    Raises:
        StructureError: for bad arguments and misfits of the scene. ResultsError: for a file that must not be replaced
        or cannot be written. Errors of building FMUs are those of `run`.
    """
    if fmi not in (2, 3):
        raise StructureError(f"fmi is {fmi}, expected 2 or 3")
    file = Path(path) if path is not None else Path(default_path(scene, suffix=PACKAGE).name)
    if file.suffix != PACKAGE:
        raise StructureError(f"{file} is to be an SSP, expected a name that ends in {PACKAGE}")
    check_package(file)
    given = {"step_size": step_size, "stop_time": stop_time, "algorithm": algorithm}
    setup = set_up(scene, parameters, fuse, **given)
    for sentence in setup.disagreements:
        warn(sentence)
    fixed, excited = with_sine(setup, SineInput(input, frequency, amplitude))
    fixed, choices = with_levels(fixed, chosen_loop(BACKENDS[0], warn), **({"inputs": [excited]} if excited else {}))
    for name, choice in choices.items():
        warn(choice.sentence(name))
    variants = Variants(fixed, setup.highest)
    is_driven = excited is not None and amplitude != 0
    built = variants.driven(excited, frequency) if excited and is_driven else variants.plain
    version = cast(Literal[2, 3], fmi)
    if sentence := remark(platforms_named(platforms), [version]):
        warn(sentence)
    files = {c.name: fmu_with_starts(c, version, platforms) for c in built.system.components}
    assembly = ready_to_step(Assembly.read(built.system, files, built.isolation), fixed.step_size)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        return Package(file, write(file, legible(file.stem), fixed, assembly))
    except OSError as error:
        raise os_refusal(file, error) from error
