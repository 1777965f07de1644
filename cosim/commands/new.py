"""The verb `new`: a repository of one's own."""

import re
import sys
from keyword import iskeyword
from pathlib import Path

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json

_NAME = "my_machine"
"""Name of the package in the template."""

_RENAMED = {"init.py": "__init__.py", "gitignore": ".gitignore"}
"""Files of the template that would act where they lie."""


def new(folder: Path, /, *, json: Json = False) -> int:
    """Make a repository of one's own: two components, a controller, a scene of them, and tests.

    `hfsa run scene.toml`, `hfsa sweep scene.toml` and `pytest` work in it as it is.

    Parameters
    ----------
    folder
        Folder to make, which is empty or not there yet; its name is that of the package.
    """
    from hfsa.cosim.systems.errors import StructureError

    name = _package_name(folder)
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise StructureError(f"{folder} exists and is not empty; expected a new folder")
    template = Path(__file__).with_name("_new")
    written = []
    try:
        for source in sorted(file for file in template.rglob("*") if file.is_file() and file.suffix != ".pyc"):
            inside = source.relative_to(template)
            file = folder / str(inside.with_name(_RENAMED.get(source.name, source.name))).replace(_NAME, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(source.read_text(encoding="utf-8").replace(_NAME, name), encoding="utf-8")
            written.append(file)
    except OSError as error:
        raise StructureError(f"{folder} cannot be written: {error.strerror or error}") from error
    text = [*map(str, written), "", f"cd {folder}", "hfsa run scene.toml", "hfsa sweep scene.toml", "pytest"]
    _shell.answer({"package": name, "files": written}, "\n".join(text), json)
    return _shell.DONE


def _package_name(folder: Path) -> str:
    """Return the name of a folder as that of a package; `StructureError` where it cannot be one."""
    from importlib.util import find_spec

    from hfsa.cosim.systems.errors import StructureError

    word = folder.resolve().name
    name = re.sub(r"\W+", "_", word.lower())
    if not re.fullmatch(r"[a-z]([a-z0-9_]*[a-z0-9])?", name) or iskeyword(name):
        raise StructureError(
            f"{word!r} is no name of a Python package; expected the letters a to z, digits and hyphens, a letter "
            "first, and no word of Python's own"
        )
    found = None if name in sys.stdlib_module_names else find_spec(name)
    # a package without __init__.py may be a mere folder: the one to be filled, or one beside it
    places = [Path(place) for place in (found and found.submodule_search_locations) or ()]
    mere = {folder.resolve(), Path(name).resolve()}
    is_taken = found is not None and (found.origin is not None or any(p.resolve() not in mere for p in places))
    if is_taken or name in (*sys.stdlib_module_names, "tests", "results"):
        raise StructureError(f"{name} is a Python package already; name the folder otherwise, such as {name}_machine")
    return name
