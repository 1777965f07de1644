"""The C itself: no warning, no undefined behaviour, no stray access, no allocation while stepping."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hfsa.fmus._sundials import Sundials, sundials
from hfsa.fmus.c_code import RUNTIME, generate
from hfsa.fmus.compile import FLAGS, compiler, source_files
from hfsa.fmus.errors import ExportError

HARNESS = Path(__file__).parent / "harness"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-strict-prototypes")
"""FMI 3's own header declares two functions without their parameters."""
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")


def run(*command: str, cwd: Path, env: dict[str, str] | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def write(files: dict[str, str], folder: Path) -> list[str]:
    """Write the files and return the names of those that are compiled."""
    for name, text in files.items():
        (folder / name).write_text(text)
    return sorted(name for name in files if name.endswith(".c"))


def sundials_or_skip() -> Sundials:
    """Skip the test where an FMU cannot be linked to SUNDIALS."""
    try:
        return sundials()
    except ExportError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory):
    """The runtime with sanitizers, once; what a model adds is compiled against it."""
    folder = tmp_path_factory.mktemp("sanitized")
    probe = folder / "probe.c"
    probe.write_text("int main(void) { return 0; }\n")
    done = subprocess.run(
        [*compiler(), *SANITIZERS, str(probe), "-o", str(folder / "probe")], capture_output=True, check=False
    )
    if done.returncode or subprocess.run([folder / "probe"], check=False).returncode:
        pytest.skip("this compiler has no AddressSanitizer")
    return folder


def test_the_sanitizers_find_a_seeded_fault(sanitized):
    """A read behind the end of an allocation ends the program."""
    (sanitized / "fault.c").write_text("#include <stdlib.h>\nint main(void) { char* p = malloc(4); return p[4]; }\n")
    run(*compiler(), *SANITIZERS, "fault.c", "-o", "fault", cwd=sanitized)
    done = subprocess.run([sanitized / "fault"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "heap-buffer-overflow" in done.stderr


def test_every_call_is_clean(sanitized, tmp_path, models, model_name):
    """harness/exercise.c with all warnings, AddressSanitizer, LeakSanitizer and UndefinedBehaviorSanitizer."""
    units = write(source_files(generate(models[model_name]())), tmp_path)
    fixed = [name for name in units if (RUNTIME / name).exists()]
    flags = ["-std=c99", "-g", "-O1", *WARNINGS, *SANITIZERS]
    objects = [sanitized / name.replace(".c", ".o") for name in fixed]
    if not all(file.exists() for file in objects):
        run(*compiler(), *flags, "-c", *fixed, cwd=tmp_path)
        for file in objects:
            os.replace(tmp_path / file.name, file)
    program = [*set(units) - set(fixed), str(HARNESS / "exercise.c"), *map(str, objects)]
    run(*compiler(), *flags, f"-I{tmp_path}", f"-I{HARNESS}", *program, "-o", "exercise", "-lm", cwd=tmp_path)
    assert " 0 failed" in run(str(tmp_path / "exercise"), cwd=tmp_path)


def test_every_call_is_clean_with_cvode(sanitized, tmp_path, models):
    """The same program with SUNDIALS, whose own code was compiled without sanitizers."""
    found, model = sundials_or_skip(), models["pendulum"]()
    model.solver = "cvode"
    units = [*write(source_files(generate(model)), tmp_path), str(HARNESS / "exercise.c")]
    flags = ["-std=c99", "-g", "-O1", *WARNINGS, *SANITIZERS, *found.compile_flags, f"-I{tmp_path}", f"-I{HARNESS}"]
    run(*compiler(), *flags, *units, "-o", "exercise", *map(str, found.libraries), "-lm", cwd=tmp_path)
    assert " 0 failed" in run(str(tmp_path / "exercise"), cwd=tmp_path)


def test_release_build_has_no_warnings(tmp_path, models):
    """The flags that FMUs are built with find nothing either: optimisation sees other things than -O1."""
    units = write(source_files(generate(models["two_link"]())), tmp_path)
    run(*compiler(), *FLAGS, *WARNINGS, "-c", *units, cwd=tmp_path)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="stands in front of glibc's malloc")
@pytest.mark.parametrize(
    ("model_name", "solver", "input_name", "output_name"),
    [
        ("mass_on_spring", "exact", "base.position", "position"),
        ("pendulum", "rosenbrock", "torque", "energy"),
        ("two_link", "rosenbrock", "torque[1]", "acceleration[2]"),
        ("chain", "exact", "force", "acceleration"),
        ("hybrid", "exact", "target", "power"),
        ("van_der_pol", "rk4", "u", "y"),
        ("pendulum", "cvode", "torque", "energy"),
    ],
)
def test_a_million_steps_allocate_nothing(tmp_path, compiled, models, model_name, solver, input_name, output_name):
    """Setting, stepping, reading, FMU states into the same memory, derivatives: harness/allocations.c counts.

    CVODE, which starts anew in every step, takes a hundredth of them.
    """
    model = models[model_name]()
    model.solver = solver
    if solver == "cvode":
        sundials_or_skip()
    sources, library = compiled(model)
    write({name: text for name, text in source_files(sources).items() if name.startswith("fmi2")}, tmp_path)
    source = str(HARNESS / "allocations.c")
    run(*compiler(), "-O1", "-rdynamic", f"-I{tmp_path}", source, "-o", "allocations", "-ldl", "-lm", cwd=tmp_path)
    references = {v.name: str(v.reference) for v in sources.variables}
    program = [
        str(tmp_path / "allocations"),
        str(library),
        sources.token,
        references[input_name],
        references[output_name],
        "10000" if solver == "cvode" else "1000000",
    ]
    assert run(*program, cwd=tmp_path) == "0 allocations, status 0, finite 1\n"
