"""Verb `export`: FMUs of a part, or of the fused groups of a scene; or a whole scene as a system structure package."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import (
    AlgorithmName,
    Arguments,
    Fuse,
    Level,
    Output,
    SineOptions,
    Step,
    given,
    refuse,
)


def export(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    fuse: Fuse = None,
    fmi: Literal[2, 3] | None = None,
    platforms: Annotated[list[str] | None, Parameter(negative=())] = None,
    ssp: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    reference_results: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    sine: SineOptions = SineOptions(),
    step: Step = None,
    stop: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    algorithm: AlgorithmName = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Write the FMU of a part, checked and with sources, or with `--ssp` a whole scene as one file for other tools.

    Parameters
    ----------
    name
        A component or controller, as in `hfsa list`, or the path of a .py file; with `--fuse` a scene, of whose groups
        the FMUs are written, with the scene's start values; with `--ssp` a scene.
    fmi
        Version of FMI (default: both; 2 with `--ssp`).
    platforms
        Platforms of the binaries: `here` (default), `all`, or names separated by commas, of x86_64-linux,
        aarch64-linux, x86_64-windows, x86_64-darwin and aarch64-darwin. All but `here` need the extra `zig`. FMI 2 has
        no name for those of aarch64.
    ssp
        Write a scene as a system structure package, SSP 1.0: FMUs, connections, units, start values, step and order,
        with a sine source at an input as of `hfsa run`, and with groups of `--fuse` as one FMU each. `--amplitude 0`
        leaves the source out. Elements have names that are legal in all tools, `drive_1` for `drive[1]`.
    reference_results
        Add an example with inputs and outputs to each FMU, by the layered standard fmi-ls-ref, under `extra/`.
    stop
        End of the run that an SSP states [s] (default: the scene's).
    output
        Folder (default: `fmus/built` in a checkout, else the working folder); with `--ssp` a file (default: `SCENE.ssp`
        in the working folder). An FMU or SSP of the same name is replaced.
    """
    from hfsa.cosim.systems.errors import StructureError

    of_scene = {**sine.arguments, **given({"step_size": step, "stop_time": stop, "algorithm": algorithm})}
    if not ssp:
        refuse(_as_options(of_scene), "an FMU has no step and no source; `--ssp` exports a scene with them")
        versions: tuple[Literal[2, 3], ...] = (fmi,) if fmi else (2, 3)
        written = _export_parts(name, level, parameter, fuse, versions, _platforms(platforms, versions), output)
        if reference_results:
            from hfsa.fmus.reference_results import add_reference_results

            for file in written:
                add_reference_results(file)
        _shell.answer({"files": written}, "\n".join(map(str, written)), json)
        return _shell.DONE
    if reference_results:
        raise StructureError("--reference-results are of an FMU, not of a scene; leave it out or --ssp")
    if level is not None:
        raise StructureError(f"a scene has no level {level!r}; name that of each component, -p robot.level={level}")
    return _export_scene(name, parameter, fuse, fmi or 2, _platforms(platforms, (fmi or 2,)), output, json, of_scene)


def _platforms(words: list[str] | None, versions: tuple[Literal[2, 3], ...]) -> tuple[str, ...]:
    """Return the names of an option, `here` where there are none; `StructureError` for wrong ones."""
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.fmus._platforms import platforms_for
    from hfsa.fmus.errors import ExportError

    names = tuple(name.strip() for word in words or ["here"] for name in word.split(","))
    try:
        platforms_for(names, versions)
    except ExportError as error:
        raise StructureError(f"--platforms: {error}") from error
    return names


def _export_parts(
    name: str,
    level: str | None,
    parameter: list[str] | None,
    fuse: list[str] | None,
    versions: tuple[Literal[2, 3], ...],
    platforms: tuple[str, ...],
    output: Path | None,
) -> list[Path]:
    """Write the FMUs of a part, or of the groups of a scene, and return their paths."""
    from hfsa.cosim.assembly.fuse import models_to_export
    from hfsa.cosim.commands._scenes import refuse_scene
    from hfsa.cosim.results.target import check_fmu
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.fmus._platforms import platforms_named, remark
    from hfsa.fmus.export import export as export_model
    from hfsa.fmus.export import file_of

    if not fuse:
        advice = (
            "`--fuse NAME,NAME` exports components of it as one FMU, `--ssp` exports all of it as one file for other "
            "tools, `run` and `sweep` simulate it"
        )
        refuse_scene(name, advice)
    if output is not None and output.exists() and not output.is_dir():
        raise StructureError(f"-o {output} is a file, expected a folder")
    values = _shell.part_arguments(level, parameter)
    models = models_to_export(name, values.pop("level", None), values, fuse or ())
    folder = output or _export_folder()
    if sentence := remark(platforms_named(platforms), versions):
        _shell.warn(sentence)
    for model in models:
        for version in versions:
            check_fmu(file_of(model, folder, version))
    return [file for model in models for file in export_model(model, folder, versions, platforms)]


def _export_scene(
    name: str,
    parameter: list[str] | None,
    fuse: list[str] | None,
    fmi: int,
    platforms: tuple[str, ...],
    output: Path | None,
    json: bool,
    options: Mapping[str, Any],
) -> int:
    """Write a scene as a package."""
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.experiments.package import package

    refuse_other(name)
    found = package(
        name,
        _shell.named_values(parameter),
        **options,
        fuse=fuse or (),
        fmi=fmi,
        platforms=platforms,
        path=output,
        warn=_shell.warn,
    )
    renamed = {component: element for component, element in found.elements.items() if component != element}
    text = [str(found.file), *(f"  {element} is {component}" for component, element in renamed.items())]
    _shell.answer({"files": [found.file], "elements": found.elements}, "\n".join(text), json)
    return _shell.DONE


def _as_options(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments under the names of their options."""
    names = {"step_size": "--step", "stop_time": "--stop"}
    return {names.get(name, f"--{name}"): value for name, value in arguments.items()}


def _export_folder() -> Path:
    """Return `fmus/built` of this checkout, else the working folder, as an installed package is read-only."""
    checkout = Path(__file__).resolve().parents[2]
    return checkout / "fmus" / "built" if (checkout / "pyproject.toml").is_file() else Path()
