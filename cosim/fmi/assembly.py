"""Assembly: a system with the FMU files and descriptions of its components."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Self

from hfsa.cosim.fmi.co_simulation import Instance, Instances, InstanceType, open_instances
from hfsa.cosim.fmi.description import Description, describe
from hfsa.cosim.systems import check, connectors
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.system import System


@dataclass(frozen=True, eq=False)
class Assembly:
    """System with the FMU file and description of each component, by component name.

    Foreign FMUs, which are components' own files, are opened in processes of their own where there is an `isolation`,
    the library that stands in for them.

    `assembly/build.py` builds an assembly from a scene, `Assembly.read` from FMU files.
    """

    system: System
    files: Mapping[str, Path]
    descriptions: Mapping[str, Description]
    isolation: Path | None = None

    @classmethod
    def read(cls, system: System, files: Mapping[str, Path], isolation: Path | None = None) -> Self:
        """Return the assembly of a system and FMU files; `StructureError` for a file that is no usable FMU."""
        return cls(system, dict(files), {name: describe(file) for name, file in files.items()}, isolation)

    @cached_property
    def connectors(self) -> dict[str, dict[str, Connector]]:
        """Variables of each component's FMU by name."""
        return {name: description.variables for name, description in self.descriptions.items()}

    def connector(self, name: str) -> Connector:
        """Return the variable with a full name; `StructureError` with the nearest names if there is none."""
        return connectors.connector(self.system, self.connectors, name)

    def check(self) -> Self:
        """Return the assembly; `StructureError` unless every connection joins an output to an input that fits."""
        check.check(self.system, self.connectors)
        return self

    def of(self, system: System) -> Self:
        """Return the assembly of another system that consists of some of the components."""
        names = [component.name for component in system.components]
        files = {name: self.files[name] for name in names}
        return replace(self, system=system, files=files, descriptions={name: self.descriptions[name] for name in names})

    def open(self, kind: type[InstanceType] = Instance) -> Instances[InstanceType]:
        """Load the FMUs and return one instance of each; a `with` statement closes them."""
        return open_instances(self.files, kind, self.foreign, self.isolation)

    @property
    def foreign(self) -> frozenset[str]:
        """Names of the components that are foreign FMUs."""
        return frozenset(component.name for component in self.system.components if component.is_foreign)

    @property
    def is_foreign(self) -> bool:
        """Whether it contains a foreign FMU, which may crash its process."""
        return bool(self.foreign)

    def __reduce__(self):
        # a worker process reads the descriptions again
        return type(self).read, (self.system, self.files, self.isolation)
