"""The platforms that an FMU may have a binary for, with their names in FMI 2 and FMI 3 and the targets of ziglang."""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import fmpy

from hfsa.fmus.errors import ExportError


@dataclass(frozen=True)
class Platform:
    """A platform.

    Attributes:
        name: architecture and system, the name of its folder in FMI 3.
        folder: name of its folder in FMI 2, which has names for x86 processors alone; otherwise empty.
        suffix: file extension of its shared libraries.
        target: its name for ziglang, with the oldest system that runs the binary; empty for this system.
        has_libm: whether the functions of mathematics are a library of their own.
    """

    name: str
    folder: str
    suffix: str
    target: str = ""
    has_libm: bool = True

    def path(self, version: int, identifier: str) -> PurePosixPath | None:
        """Return the path of its binary in an FMU, `None` where that version of FMI has no name for the platform."""
        folder = self.folder if version == 2 else self.name
        return PurePosixPath("binaries", folder, identifier + self.suffix) if folder else None


HERE = Platform(fmpy.platform_tuple, fmpy.platform, fmpy.sharedLibraryExtension)
"""The platform that runs this, with its own compiler."""

PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
        Platform("aarch64-linux", "", ".so", "aarch64-linux-gnu.2.17"),
        Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu", has_libm=False),
        Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos.11.0"),
        Platform("aarch64-darwin", "", ".dylib", "aarch64-macos.11.0"),
    )
}
"""Platforms by name, for which ziglang compiles anywhere."""


def platforms_for(words: Sequence[str], versions: Iterable[int]) -> list[Platform]:
    """Return the platforms with names, as `platforms_named`, for files of some versions of FMI.

    `ExportError` also where a version has a name for none of them.
    """
    found = platforms_named(words)
    for version in versions:
        if len(unnamed(found, version)) == len(found):
            raise ExportError(f"FMI {version} has no name for {', '.join(unnamed(found, version))}; FMI 3 has")
    return found


def platforms_named(words: Sequence[str]) -> list[Platform]:
    """Return the platforms with names; `here` is that which runs this, `all` are those of `PLATFORMS`.

    `ExportError` for a name that is none, and for no names.
    """
    found: dict[str, Platform] = {}
    for word in words:
        if word == "all":
            found |= PLATFORMS
        elif word == "here":
            found.setdefault(HERE.name, HERE)
        elif word in PLATFORMS:
            found[word] = PLATFORMS[word]
        else:
            near = difflib.get_close_matches(word, PLATFORMS, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ExportError(f"platform {word!r} is not one of here, all, {', '.join(PLATFORMS)}{hint}")
    if not found:
        raise ExportError(f"no platforms; expected here, all, or some of {', '.join(PLATFORMS)}")
    return list(found.values())


def remark(platforms: Iterable[Platform], versions: Iterable[int]) -> str:
    """Return a sentence on the platforms that versions of FMI have no name for, empty where there are none."""
    left_out = {version: unnamed(platforms, version) for version in versions}
    return "; ".join(
        f"FMI {version} has no name for {', '.join(names)}: its files have no binary for them"
        for version, names in left_out.items()
        if names
    )


def unnamed(platforms: Iterable[Platform], version: int) -> list[str]:
    """Return the names of the platforms that a version of FMI has no name for."""
    return [platform.name for platform in platforms if platform.path(version, "") is None]
