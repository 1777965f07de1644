"""FMU loaded for one of the two interface types."""

import shutil
from collections.abc import Mapping
from contextlib import ExitStack
from multiprocessing.util import Finalize
from pathlib import Path
from typing import ClassVar

from hfsa.cosim.archives.archive import Archive
from hfsa.cosim.archives.scratch import new_folder
from hfsa.cosim.fmi.co_simulation_library import CO_SIMULATION
from hfsa.cosim.fmi.description import Interface, describe
from hfsa.cosim.fmi.library import Library
from hfsa.cosim.fmi.model_exchange_library import MODEL_EXCHANGE
from hfsa.cosim.systems.errors import StructureError

_LIBRARIES: dict[Interface, Mapping[int, type[Library]]] = {
    "co_simulation": CO_SIMULATION,
    "model_exchange": MODEL_EXCHANGE,
}


class Fmu:
    """FMU loaded for one interface type: its description, its library, and the folder of its unzipped files.

    `Fmu.load` returns the same object for the same file and interface; `close` or the end of the process removes the
    folder.

    Attributes:
        holder: name of the last instance of it that is not freed, `None` where there is none.
        description: description of the FMU; `name`, `version` and `variables` (by name) are taken from it.
    """

    _loaded: ClassVar[dict[tuple, "Fmu"]] = {}

    def __init__(self, file: Path, interface: Interface = "co_simulation", isolation: Path | None = None):
        self.description = describe(file, interface)
        self.holder: str | None = None
        self.name, self.version = self.description.name, self.description.version
        self.variables = self.description.variables
        folder, keeper = new_folder()
        # worker processes of a pool run finalizers, but not atexit
        self._remove = Finalize(self, _remove, (folder, keeper), exitpriority=0)
        with Archive(file, str(file), "FMU") as archive:
            archive.unpack(folder, lambda name: not name.startswith(("sources/", "documentation/")))
        self.library = _LIBRARIES[interface][self.version](self.description, folder, isolation)

    @classmethod
    def load(cls, file: str | Path, interface: Interface = "co_simulation", isolation: Path | None = None) -> "Fmu":
        """Load a `.fmu` file once per process; `StructureError` where it lacks the interface or the binary.

        `isolation` is the library that gives each instance a process of its own; `None` loads the binary into this one.
        """
        path = Path(file).resolve()
        if not path.is_file():
            raise StructureError(f"there is no file {path}")
        key = (path, interface, path.stat().st_mtime_ns, path.stat().st_size, isolation)
        if key not in cls._loaded:
            cls._loaded[key] = cls(path, interface, isolation)
        return cls._loaded[key]

    def close(self) -> None:
        """Unload the library and remove the folder; all instances must be closed before."""
        self.library.close()
        self._remove()
        for key in [key for key, fmu in self._loaded.items() if fmu is self]:
            del self._loaded[key]


def _remove(folder: Path, keeper: ExitStack) -> None:
    """Remove the folder of an FMU, then let its owner go."""
    shutil.rmtree(folder, ignore_errors=True)
    keeper.close()
