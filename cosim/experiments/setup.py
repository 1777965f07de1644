"""Setup of an experiment: a scene with all options applied, before anything runs.

setup = set_up("sdelta_shaker", {"damping": "0.02"}, step_size=20e-6)
setup.scene, setup.title
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from hfsa.cosim.assembly import default_experiment
from hfsa.cosim.assembly.agreement import disagreements
from hfsa.cosim.assembly.assemble import assemble
from hfsa.cosim.assembly.fuse import with_fusion
from hfsa.cosim.assembly.load_scene import DOCUMENT, available_scenes, load_scene, with_arguments
from hfsa.cosim.assembly.outline import outlined
from hfsa.cosim.assembly.outside import outside
from hfsa.cosim.assembly.packages import PACKAGE, package_of
from hfsa.cosim.experiments.drive import released, requested, with_companions
from hfsa.cosim.experiments.orders import with_order
from hfsa.cosim.experiments.selection import find_signals, signals
from hfsa.cosim.experiments.tuning import tuned_options
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.masters.algorithms import check_algorithm
from hfsa.cosim.results.files import LevelChoice
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedthrough import refuse_loops
from hfsa.cosim.systems.loose_ends import loose_ends
from hfsa.cosim.systems.names import legible, refuse_signal
from hfsa.cosim.systems.scene import Scene

ALGEBRAIC_LOOPS = ("solve", "refuse")
"""Treatments of algebraic loops between FMUs; the first is the default."""

_FORMATS = (".h5", ".hdf5", ".nc", ".png", ".pdf", ".svg", ".jpg", ".jpeg", ".eps", ".tif", ".tiff", ".webp")
"""File name endings that are not taken for names of signals."""

Warn = Callable[[str], None]
"""Function that receives a warning for the user."""


@dataclass(frozen=True)
class Setup:
    """Scene with the title of its results.

    Attributes:
        order: order of steps as typed (`orders.py`).
        signals: full names of variables recorded in addition to the scene's outputs.
        driven: signals by the full name of the input that each feeds.
        disagreements: a sentence for each fact on which parts of the scene disagree, for the loose ends of a scene that
            does not come with hfsa, and for what is ignored of a package.
    """

    scene: Scene
    title: str
    order: str | None = None
    signals: Sequence[str] = ()
    driven: Mapping[str, Signal] = field(default_factory=dict)
    disagreements: Sequence[str] = ()

    @cached_property
    def highest(self) -> Assembly:
        """Descriptions before fusing, without FMUs, with the highest level for `auto`: they have all names."""
        return outlined(levels.at_highest(self.scene).system)


def set_up(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    fuse: Sequence[str] = (),
    algebraic_loops: str = ALGEBRAIC_LOOPS[0],
    order: str | None = None,
    *,
    file: Path | None = None,
    record: Sequence[str] = (),
    drive: Mapping[str, Any] | None = None,
    tuned: str | Path | None = None,
    **changes: Any,
) -> Setup:
    """Return the setup of a scene, given by name, path or object, with arguments of the scene or its components.

    Args:
        scene: name, path of a `.py`, `.toml` or `.ssp` file, or a `Scene`.
        parameters: arguments of the scene or of its components.
        fuse: groups of components, each compiled into one FMU.
        algebraic_loops: one of `ALGEBRAIC_LOOPS`; with `refuse`, an algebraic loop is a `StructureError`.
        order: order of steps as typed.
        file: output file; `StructureError` where it has the name of a signal.
        record: further signals to record, beside those of the scene.
        tuned: results file of a trade, whose answer determines levels, groups, algorithm and step.
        changes: new values of fields of the scene; `None` keeps a field.
    """
    if tuned is not None:
        determined = {"fuse": fuse, "order": order, "step": changes["step_size"], "algorithm": changes["algorithm"]}
        parameters, options = tuned_options(tuned, scene, parameters, determined)
        fuse, changes = options.pop("fuse"), {**changes, **options}
    name = "" if isinstance(scene, Scene) else str(scene)
    loaded = with_arguments(scene, parameters) if isinstance(scene, Scene) else load_scene(name, parameters)
    loaded = with_fusion(loaded, fuse)
    loaded = dataclasses.replace(loaded, **{key: value for key, value in changes.items() if value is not None})
    check_algorithm(loaded.algorithm)
    if algebraic_loops == "refuse":
        _refuse_loops(loaded)
    if order is not None:
        loaded = with_order(loaded, order)
    known = available_scenes().get(name)
    title = known.doc.partition(":")[0].rstrip(".") if known else legible(Path(name).stem) or "A scene"
    setup = Setup(loaded, title, order)
    if drive:
        setup = _driven(setup, drive, record)
    if file is not None and file.suffix not in _FORMATS:
        refuse_signal(file, signals(setup.highest.connectors))
    named = find_signals(record, (), setup.highest.connectors, "signal") if record else ()
    further = tuple(s for s in dict.fromkeys((*setup.scene.recorded, *named)) if s not in loaded.outputs)
    sentences = [*_remarks(name, loaded), *disagreements(name, parameters or {}, setup.scene)]
    if known is None:
        sentences += _loose_ends(setup, [*further, *with_companions(setup.driven, setup.highest)])
    return dataclasses.replace(setup, signals=further, disagreements=sentences)


def _remarks(name: str, scene: Scene) -> Sequence[str]:
    """Return what the file of a scene leaves to others, or what is ignored of it, and what it runs from elsewhere."""
    if name.endswith(PACKAGE):
        return package_of(name).remarks
    file = Path(name)
    return [*default_experiment.remarks(file, scene), *outside(file, scene)] if name.endswith(DOCUMENT) else ()


def _driven(setup: Setup, drive: Mapping[str, Any], record: Sequence[str]) -> Setup:
    """Return the setup with inputs driven by signals, which nothing else feeds then; errors as of `drive.requested`."""
    scene, known = setup.scene, setup.highest
    driven = requested(drive, scene, known)
    named = find_signals(record, (), known.connectors, "signal") if record else ()
    used = [*scene.outputs, *scene.recorded, *named]
    return Setup(released(scene, with_companions(driven, known), used), setup.title, setup.order, driven=driven)


def _loose_ends(setup: Setup, further: Sequence[str]) -> list[str]:
    """Return the sentences on what a scene leaves unconnected; `further` are recorded beside its outputs."""
    scene = setup.scene
    if scene.quiet_inputs:
        return []
    used = {*scene.inputs, *scene.outputs, *further}
    return loose_ends(scene.system, setup.highest.connectors, used)


def default_path(scene: str | Path | Scene, ending: str = "", suffix: str = ".h5") -> Path:
    """Return the default results file of an experiment: `results/SCENE.h5`."""
    if isinstance(scene, Scene):
        raise StructureError("a Scene object has no name for its results file; name the file: path=...")
    return Path("results", f"{Path(scene).stem}{ending}{suffix}")


def refuse_order(setup: Setup) -> None:
    """Raise `StructureError` where an order is given for a method without steps."""
    if setup.order is not None:
        raise StructureError(f"--order {setup.order}: the linear method takes no steps and has no order")


def with_levels(scene: Scene, library: Path | None, **measured: Any) -> tuple[Scene, dict[str, LevelChoice]]:
    """Return the scene with a chosen level in place of every `auto`, and the choices by component.

    `measured` overrides fields of the scene for the measurement: inputs, outputs, band.
    """
    if not levels.automatic(scene):
        return scene, {}
    choices = levels.choose(dataclasses.replace(scene, **measured), library)
    return levels.with_chosen(scene, choices), choices


def _refuse_loops(scene: Scene) -> None:
    """Raise `StructureError` where the FMUs of a scene, fused and at their highest levels, form an algebraic loop."""
    assembly = assemble(levels.at_highest(scene)).check()
    refuse_loops(assembly.system, assembly.connectors)
