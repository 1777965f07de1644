"""Pictures of deformed parts on the command line."""

from collections.abc import Mapping
from pathlib import Path

from hfsa.components._modelling.arguments import arguments_of, takes
from hfsa.components._modelling.parts import Part
from hfsa.cosim.figures.deformation import deformation_figure, save
from hfsa.cosim.results.target import check_picture
from hfsa.cosim.systems.errors import StructureError


def check_picture_alone(file: Path, is_study: bool) -> None:
    """Raise `StructureError` for a picture beside a study, `ResultsError` for a file that it may not replace."""
    if is_study:
        raise StructureError(f"--picture {file} is of the part as it is, not of a study or a path; take one at a time")
    check_picture(file)


def picture_of(part: Part, words: Mapping[str, str], file: Path) -> str:
    """Write the picture of a part with the arguments of its analysis that it takes; return the file's name."""
    known = arguments_of(part.deformation)
    found = part.deformed(**{name: value for name, value in words.items() if takes(known, name)})
    save(deformation_figure(found.title, found.points, found.triangles, found.displacement, found.stress), file)
    return str(file)
