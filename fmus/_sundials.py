"""Search for an installation of SUNDIALS, whose headers and libraries an FMU with the solver CVODE requires.

The search is for headers and static libraries of SUNDIALS 6 or later, so that the FMU is self-contained. It covers
`$SUNDIALS_ROOT`, or by default /usr and /usr/local, the prefixes of packages such as Debian's libsundials-dev.
"""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

from hfsa.fmus.errors import ExportError

LIBRARIES = ("cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense", "sunnonlinsolnewton")
"""Names of the libraries after `libsundials_`, without the common one: core, or generic before SUNDIALS 7."""

_COMMON = ("core", "generic")
_LICENSES = ("include/sundials/LICENSE", "include/sundials/NOTICE", "share/doc/libsundials-dev/copyright")


@dataclass(frozen=True)
class Sundials:
    """An installation of SUNDIALS.

    Attributes:
        root: prefix of the installation, such as /usr.
        libraries: static libraries in link order.
    """

    root: Path
    libraries: tuple[Path, ...]

    @property
    def compile_flags(self) -> list[str]:
        """Compiler flags for the headers."""
        return ["-isystem", str(self.root / "include")]

    @property
    def link_flags(self) -> list[str]:
        """Linker flags: the libraries, with hidden symbols."""
        hidden = ["-Wl,--exclude-libs,ALL"] if sys.platform.startswith("linux") else []
        return [*map(str, self.libraries), *hidden]

    @property
    def license(self) -> str:
        """Licence texts of SUNDIALS, which must accompany its binaries."""
        files = [self.root / name for name in _LICENSES]
        return "\n\n".join(file.read_text(encoding="utf-8") for file in files if file.is_file())


def sundials() -> Sundials:
    """Return the first complete installation; `ExportError` with the missing files of each prefix if there is none."""
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
        f"elsewhere set $SUNDIALS_ROOT): {'; '.join(lacking)}. Solvers without SUNDIALS are 'rosenbrock', 'rk4' and, "
        "for linear models, 'exact'"
    )


def _library(root: Path, name: str) -> Path | None:
    """Return the path of a static library, also in a Debian folder of an architecture; `None` if there is none."""
    for folder in ("lib", "lib64", "lib/*-*"):
        for path in sorted(root.glob(f"{folder}/libsundials_{name}.a")):
            return path
    return None
