"""The house as a whole: style, floors, packaging, and that nothing depends on the checkout."""

import ast
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("components", "controllers", "cosim", "fmus")


def run(*command: str, cwd: Path = ROOT, env: dict[str, str] | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_style():
    run(sys.executable, "-m", "ruff", "check")
    run(sys.executable, "-m", "ruff", "format", "--check")


def test_floors():
    """A room imports only from below, and only a .fmu file joins the two wings."""
    run(str(Path(sys.executable).with_name("lint-imports")))


ROOF = {"assembly", "fidelity", "tradeoff", "experiments", "commands"}
"""The rooms of the right wing that see the left one."""


def below_the_roof() -> set[str]:
    """Every room of the right wing but the roof."""
    return {folder.parent.name for folder in (ROOT / "cosim").glob("*/__init__.py")} - ROOF


def test_the_wall_goes_around_every_room():
    """A new room is inside by default: it is in the contract, or this test fails."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (wall,) = (contract for contract in contracts if "hfsa.cosim.measurement" in contract.get("source_modules", ()))
    assert set(wall["source_modules"]) == {f"hfsa.cosim.{room}" for room in below_the_roof()}
    assert wall["forbidden_modules"] == ["hfsa.components", "hfsa.controllers", "hfsa.fmus"]
    assert not wall.get("ignore_imports")


def test_the_wall_holds(tmp_path):
    """An import of the left wing planted into any room below the roof is found."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / "hfsa" / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for room in below_the_roof():
        (tmp_path / "hfsa/cosim" / room / "planted.py").write_text("from hfsa.components import Model\n")
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True)
    assert done.returncode == 1
    words = done.stdout.decode()
    for room in below_the_roof():
        assert f"hfsa.cosim.{room}.planted -> hfsa.components" in words


def test_parts_stand_alone():
    """The exporter takes a `Model`, never a single part; and a component imports frames, never another component."""
    graph = grimp.build_graph(*(f"hfsa.{package}" for package in PACKAGES))
    parts = {m for m in graph.modules if m.startswith("hfsa.components.") and not m.split(".")[2].startswith("_")}
    assert "hfsa.components.sdelta" in parts
    for part in parts:
        users = graph.find_modules_that_directly_import(part)
        assert {user.split(".")[1] for user in users} <= {"controllers"}, f"{part} is imported by {users}"


def test_no_room_knows_a_part_by_name():
    """Parts declare what holds of them; only those of scenes, measurements and connections are named."""
    names = {file.stem for package in ("components", "controllers") for file in (ROOT / package).glob("[!_]*.py")}
    found = set()
    for file in (file for file in (ROOT / "cosim").rglob("*.py") if file.parent.name != "scenes"):
        nodes = ast.walk(ast.parse(file.read_text()))
        words = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        found |= {(file.name, name) for name in words & names}
    named = ("sine_source", "lock_in", "multisine_source", "sampler", "linear_transformation")
    assert found == {("scene.py", name) for name in named}


def test_modules_say_what_they_are():
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            first = file.read_text().split("\n", 1)[0]
            assert first.startswith('"""'), f"{file} has no docstring"
            assert first.rstrip('"').rstrip().endswith((".", ":")) or '"""' not in first[3:], f"{file}: {first}"


def test_no_local_path_or_lock_address():
    for lock in ROOT.glob("requirements*.lock"):
        assert "://" not in lock.read_text()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel of a copy of the checkout, so that nothing an earlier build left is in it, unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    everywhere = shutil.ignore_patterns(".git", ".venv", ".*_cache", "*.egg-info", "__pycache__")

    def left_out(place: str, names: list[str]) -> set[str]:
        """Return the names of files from an earlier build or run."""
        return {*everywhere(place, names), *({"build", "results"} if Path(place) == ROOT else ())}

    shutil.copytree(ROOT, folder / "copy", symlinks=True, ignore=left_out)
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(folder / "copy"))
    (file,) = folder.glob("*.whl")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_exports_an_fmu(wheel, tmp_path):
    """A folder missing from `packages` or a .c from `package-data` breaks only the wheel."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import hfsa.fmus.export as e, hfsa.components.mass_on_spring as c\n"
        "from pathlib import Path\n"
        "assert Path(e.__file__).is_relative_to(sys.argv[1]), e.__file__\n"
        "print(*e.export(c.mass_on_spring(), Path(sys.argv[2])))\n"
    )
    files = run(sys.executable, "-c", code, str(wheel), str(tmp_path), cwd=tmp_path).split()
    assert [Path(file).name for file in files] == ["MassOnSpring.fmi2.fmu", "MassOnSpring.fmi3.fmu"]


def sources(folder: Path) -> set[str]:
    return {str(f.relative_to(folder)) for f in folder.rglob("*") if f.suffix in (".py", ".c", ".h")}


def test_the_wheel_has_every_module_of_the_checkout(wheel):
    here = {f"{package}/{file}" for package in PACKAGES for file in sources(ROOT / package)}
    assert here == sources(wheel / "hfsa")


def test_the_wheel_makes_a_repository_of_ones_own(wheel, tmp_path):
    code = "import sys; sys.path.insert(0, sys.argv[1])\nfrom hfsa.cosim.cli import main\nmain(['new', 'mine'])\n"
    run(sys.executable, "-c", code, str(wheel), cwd=tmp_path)
    template = [file for file in (ROOT / "cosim/commands/_new").rglob("*") if file.is_file() and file.suffix != ".pyc"]
    assert len([file for file in (tmp_path / "mine").rglob("*") if file.is_file()]) == len(template)
    assert (tmp_path / "mine/.gitignore").is_file()
