"""The platforms that an FMU may have a binary for, with their names in FMI 2 and FMI 3 and the targets of ziglang."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """A platform.

    Attributes:
        tuple: name of its folder in FMI 3, architecture and system, also its name here.
        folder: name of its folder in FMI 2, which has names for x86 processors alone; otherwise empty.
        target: its name for ziglang; systems as old as these run the binary.
        suffix: file extension of its shared libraries.
        has_libm: whether the functions of mathematics are a library of their own.
    """

    tuple: str
    folder: str
    target: str
    suffix: str
    has_libm: bool = True


PLATFORMS = {
    platform.tuple: platform
    for platform in (
        Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
        Platform("aarch64-linux", "", "aarch64-linux-gnu.2.17", ".so"),
        Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll", has_libm=False),
        Platform("x86_64-darwin", "darwin64", "x86_64-macos.11.0", ".dylib"),
        Platform("aarch64-darwin", "", "aarch64-macos.11.0", ".dylib"),
    )
}
"""Platforms by name."""

HERE, ALL = "here", "all"
"""Words for this platform alone, and for all."""
