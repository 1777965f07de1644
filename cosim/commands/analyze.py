"""Verb `analyze`: engineering numbers of a part, and its design study."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import DESIGN_STUDY, Arguments, Force, Level


def analyze(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    mesh: Annotated[str | None, Parameter(("--mesh",))] = None,
    sensitivity: Annotated[bool, Parameter(group=DESIGN_STUDY, negative=(), show_default=False)] = False,
    map: Annotated[str | None, Parameter(group=DESIGN_STUDY)] = None,  # noqa: A002 (name of the option)
    optimize: Annotated[bool, Parameter(group=DESIGN_STUDY, negative=(), show_default=False)] = False,
    bounds: Annotated[str | None, Parameter(group=DESIGN_STUDY)] = None,
    path: Annotated[Path | None, Parameter(group=DESIGN_STUDY)] = None,
    picture: Annotated[Path | None, Parameter(group=DESIGN_STUDY)] = None,
    over: Annotated[list[str] | None, Parameter("--over", negative=())] = None,
    output: Annotated[Path | None, Parameter(("-o", "--output"), group=DESIGN_STUDY)] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Print the engineering numbers of a part, such as stiffness, modes, compliance or mobility.

    Parameters
    ----------
    name
        A component, controller or analysis, as in `hfsa list`, or the path of a .py file.
    mesh
        Size of the triangles at the necks [m], of a part and level with finite elements: the argument `mesh`.
    sensitivity
        Sensitivity of each response to each dimension, d ln(response) / d ln(dimension), largest first.
    map
        DIMENSION,DIMENSION: map of the responses over two dimensions, as HDF5 and as a picture. A range may be given,
        `tm=10e-6:40e-6,l` (default: half to twice the present value).
    optimize
        Dimensions within bounds that maximise the first response.
    bounds
        With `--optimize`: PERCENT on either side of the present dimensions (default: 20), and for single dimensions
        DIMENSION=LOW:HIGH, or one value to fix it: `30,tm=10e-6:40e-6,w=3e-4`.
    path
        FILE.csv: the numbers along a path, as HDF5 and as a picture. Its first row names the columns, dimensions of the
        path such as `x,y,z,rz,rx,ry` (m and degrees) and optionally `t`, the time; what it does not name stays.
    picture
        FILE.png, .pdf or .svg: a picture of the part instead of its numbers, with the arguments of the picture.
    over
        NAME=VALUES, repeatable: the numbers for each combination of values, as one table. Values are separated by
        commas, or by semicolons where they have commas; `0:12e-6:7` are seven values from 0 to 12e-6.
    output
        With `--map` or `--path`: file of the results (default: `results/NAME_map.h5` or `results/NAME_path.h5`). With
        `--over`: file of the table, with `--sensitivity`: a picture (default: none).
    """
    from hfsa.components._modelling.catalogue import drawn, following, part_named, studied
    from hfsa.cosim.assembly.models import available_parts
    from hfsa.cosim.commands._analyses import over_answer
    from hfsa.cosim.commands._numbers import numbers_text
    from hfsa.cosim.commands._paths import path_answer
    from hfsa.cosim.commands._pictures import picture_answer
    from hfsa.cosim.commands._scenes import refuse_scene
    from hfsa.cosim.commands._studies import StudyRequest, study_answer

    refuse_scene(name, "`run`, `sweep` and `stability` examine it")
    values = _shell.part_arguments(level, [*([] if mesh is None else [f"mesh={mesh}"]), *(parameter or ())])
    request = StudyRequest(sensitivity, map, optimize, bounds, output, force, path, picture, bool(over))
    is_study = request.is_study()
    if picture is not None:
        _shell.answer(*picture_answer(drawn(name, available_parts()), values, picture), json)
        return _shell.DONE
    if over:
        data, text, is_complete = over_answer(name, over, values, output, force)
        _shell.answer(data, text, json)
        return _shell.DONE if is_complete else _shell.PROBLEMS
    if path is not None:
        part = following(name, available_parts())
        file = _shell.results_file(output, part.name, "path", force)
        study = part.path_study(**values)
        _shell.answer(
            *path_answer(study, path, file, _shell.described_part(part.name, part.with_contents(values)), force), json
        )
        return _shell.DONE
    if is_study:
        part = studied(name, available_parts())
        study = part.design_study(**values)
        data, text, is_found = study_answer(study, request, part.name, part.with_contents(values))
        _shell.answer(data, text, json)
        return _shell.DONE if is_found else _shell.PROBLEMS
    part = part_named(name, available_parts())
    numbers = part.analysis(**values)
    units = {key: part.units[key] for key in numbers if key in part.units}
    if json:
        numbers = _shell.plain(numbers, f"{part.name}: analyze()")
    _shell.answer({**numbers, "units": units}, numbers_text(numbers, units), json)
    return _shell.DONE
