"""An assembly: a system whose FMUs exist and have been read, once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

from hfsa.cosim.fmi.co_simulation import Instance, Instances, open_instances
from hfsa.cosim.fmi.description import Description, describe
from hfsa.cosim.systems import connectors
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.system import System


@dataclass(frozen=True, eq=False)
class Assembly:
    """A system with the FMU file of each component and its description, by component name.

    `assembly/build.py` makes them from scenes; `Assembly.read` from files of one's own.
    """

    system: System
    files: Mapping[str, Path]
    descriptions: Mapping[str, Description]

    @classmethod
    def read(cls, system: System, files: Mapping[str, Path]) -> Self:
        """Return the assembly of a system and FMU files; `StructureError` where a file is no FMU that can be run."""
        return cls(system, dict(files), {name: describe(file) for name, file in files.items()})

    @cached_property
    def connectors(self) -> dict[str, dict[str, Connector]]:
        """Variables of each component's FMU by name."""
        return {name: description.variables for name, description in self.descriptions.items()}

    def connector(self, name: str) -> Connector:
        """Return the variable of a full name; `StructureError` with the nearest names if there is none."""
        return connectors.connector(self.system, self.connectors, name)

    def check(self) -> Self:
        """Return the assembly; `StructureError` unless every connection joins an output to an input of its unit."""
        connectors.check(self.system, self.connectors)
        return self

    def of(self, system: System) -> Self:
        """Return the assembly of a system with some of the components, wired as it is."""
        names = [component.name for component in system.components]
        files = {name: self.files[name] for name in names}
        return replace(self, system=system, files=files, descriptions={name: self.descriptions[name] for name in names})

    def open(self) -> Instances[Instance]:
        """Load the FMUs and return one instance of each, closed at the end of a `with`."""
        return open_instances(self.files)

    @property
    def is_foreign(self) -> bool:
        """Whether an FMU of another maker is among them, which may end the process it runs in."""
        return any(component.part.endswith(".fmu") for component in self.system.components)

    def __reduce__(self):
        # a worker process reads the descriptions of its own copy
        return type(self).read, (self.system, self.files)
