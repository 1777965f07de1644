"""Programs that a scene file names outside its own folder: opening the scene runs them, and its reader may not know.

outside(Path("ball.toml"), scene)      # ["ball.toml names programs outside its folder: ball: /tmp/Ball.fmu"]
"""

from pathlib import Path

from hfsa.cosim.systems.scene import Scene

_PROGRAMS = (".fmu", ".py")


def outside(file: Path, scene: Scene) -> list[str]:
    """Return a sentence on the FMUs and parts of a scene that lie outside the folder of its file; none where all do."""
    folder = file.parent.resolve()
    programs = {
        component.name: Path(component.part)
        for component in (*scene.system.components, scene.source)
        if component.part.endswith(_PROGRAMS)
    }
    found = [f"{name}: {path.resolve()}" for name, path in programs.items() if not _is_in(folder, path)]
    return [f"{file} names programs outside its folder, and runs them: {', '.join(found)}"] if found else []


def _is_in(folder: Path, path: Path) -> bool:
    """Whether a path, its links followed, lies in a folder."""
    return path.resolve().is_relative_to(folder)
