"""Where SUNDIALS is on this machine: what an FMU that solves with CVODE is compiled with and linked to.

Wanted are the headers and the static libraries of SUNDIALS 6 or later, so that the FMU brings all of it along. They are
looked for in `$SUNDIALS_ROOT`, or without it in /usr and /usr/local, where packages such as Debian's libsundials-dev
put them.
"""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

from hfsa.fmus.errors import ExportError

LIBRARIES = ("cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense", "sunnonlinsolnewton")
"""Names of the libraries behind `libsundials_`, but for the one that all need: core, or generic before SUNDIALS 7."""

_COMMON = ("core", "generic")
_LICENSES = ("include/sundials/LICENSE", "include/sundials/NOTICE", "share/doc/libsundials-dev/copyright")


@dataclass(frozen=True)
class Sundials:
    """An installation.

    Attributes:
        root: its prefix, such as /usr.
        libraries: the static libraries, in the order in which they are linked.
    """

    root: Path
    libraries: tuple[Path, ...]

    @property
    def compile_flags(self) -> list[str]:
        """What the compiler needs to find the headers."""
        return ["-isystem", str(self.root / "include")]

    @property
    def link_flags(self) -> list[str]:
        """What the linker needs: the libraries, whose names stay inside the FMU."""
        hidden = ["-Wl,--exclude-libs,ALL"] if sys.platform.startswith("linux") else []
        return [*map(str, self.libraries), *hidden]

    @property
    def license(self) -> str:
        """The texts that come with it and that must go along with its binaries."""
        files = [self.root / name for name in _LICENSES]
        return "\n\n".join(file.read_text(encoding="utf-8") for file in files if file.is_file())


def sundials() -> Sundials:
    """Return the first installation that is complete; `ExportError` says what each place lacks."""
    own = os.environ.get("SUNDIALS_ROOT")
    roots = [Path(own)] if own else [Path("/usr"), Path("/usr/local")]
    lacking = []
    for root in roots:
        common = next((name for name in _COMMON if _library(root, name)), _COMMON[0])
        found = {name: _library(root, name) for name in (*LIBRARIES, common)}
        missing = [f"libsundials_{name}.a" for name, path in found.items() if path is None]
        if not (root / "include" / "cvode" / "cvode.h").is_file():
            missing.insert(0, "include/cvode/cvode.h")
        if not missing:
            return Sundials(root.absolute(), tuple(path for path in found.values() if path))
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        lacking.append(f"{root} has no {missing[0]}{more}")
    raise ExportError(
        "solver 'cvode' needs the headers and static libraries of SUNDIALS 6 or later (Debian: libsundials-dev; "
        f"elsewhere set $SUNDIALS_ROOT): {'; '.join(lacking)}. Without them there are 'rosenbrock' and 'rk4', and "
        "'exact' for linear models"
    )


def _library(root: Path, name: str) -> Path | None:
    """Return the path of a static library; Debian has a folder for each architecture."""
    for folder in ("lib", "lib64", "lib/*-*"):
        for path in sorted(root.glob(f"{folder}/libsundials_{name}.a")):
            return path
    return None
