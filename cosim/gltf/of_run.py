"""3D model of a run: the machines that moved, displaced as recorded, magnified and in slow motion where need be.

The displacements of a shape over time, a matrix (rows, 3 points), are the sum of a few fields by its singular value
decomposition. Small motion of a rigid body has six of them at most. What is left out is measured.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.gltf.model import Animation, Model, Shape, metres, notes_of, solid
from hfsa.cosim.pages.bodies import FRAMES, Body, left_out, one_two_five
from hfsa.cosim.pages.thinning import kept_rows
from hfsa.cosim.results.recorded import Recorded
from hfsa.cosim.results.records import ResultsError

_FIELDS = 16
"""Number of targets of a shape at most."""
_NOTHING = 1e-6
"""Singular value, relative to the largest, below which a field is left out."""
_TOLD = 1e-3
"""Error of the displacements, relative to the largest, from which on it is told."""
_SHORTEST = 4.0
"""Least time that a motion plays [s]; a shorter one is in slow motion."""


def model_of_run(recorded: Recorded, bodies: Sequence[Body]) -> tuple[Model, list[str]]:
    """Return the 3D model of the bodies of a run, and sentences on what it leaves out.

    `ResultsError` for a motion with values that are no numbers, or panels whose coordinates are no lengths.
    """
    kept = kept_rows(len(recorded.at), FRAMES)
    sentences = left_out(recorded, bodies, kept)
    time = recorded.at[kept] - recorded.at[kept[0]]
    slow = _slower(float(time[-1]))
    shapes: list[Shape] = []
    scenes, weights = [], {}
    facts = {"first_time": float(recorded.at[kept[0]]), "slow_motion": slow}
    for body in bodies:
        factor, places, worst = metres(body.panel), [], 0.0
        facts[f"magnification of {body.name}"] = body.magnification
        for layer, shift in zip(body.panel.layers, body.displacements, strict=True):
            if not layer.cells.size:
                continue
            targets: Sequence[NDArray[np.float64]] = ()
            if shift is not None:
                moved = body.magnification * solid(shift[kept], factor)
                if not np.all(np.isfinite(moved)):
                    raise ResultsError(
                        f"the motion of {body.name} has values that are no numbers, expected finite ones; --from and "
                        "--to choose a stretch"
                    )
                targets, weights[len(shapes)], error = _fields(moved)
                worst = max(worst, error)
            places.append(len(shapes))
            name = f"{body.name} {layer.name or layer.role}"
            points = solid(layer.points, factor)
            shapes.append(Shape(name, points, layer.cells, layer.role, None, targets, notes_of(layer)))
        if worst > _TOLD:
            sentences.append(
                f"the motion of {body.name} is drawn within {100 * worst:.2g} % of its largest displacement"
            )
        scenes.append((body.name, places))
    weights = {place: found for place, found in weights.items() if found.shape[1]}
    words = f"recorded motion, {', '.join(f'{body.name} magnified {body.magnification:g} times' for body in bodies)}"
    animation = Animation(words + (f", {slow:g} times slower" if slow != 1 else ""), slow * time, weights, facts)
    return Model(recorded.title, shapes, scenes, [animation] if weights else []), sentences


def _slower(duration: float) -> float:
    """Return the factor of slow motion: 1, or 1, 2 or 5 times a power of ten that makes the motion long enough."""
    # of two such numbers in turn, one is at most 2.5 times the other
    return one_two_five(2.5 * _SHORTEST / duration) if 0 < duration < _SHORTEST else 1.0


def _fields(
    moved: NDArray[np.float64],
) -> tuple[list[NDArray[np.float64]], NDArray[np.float64], float]:
    """Return targets (points, 3), weights (rows, targets) from -1 to 1, and the relative error of their sum.

    `moved` are displacements (rows, points, 3) [m].
    """
    rows, points, _ = moved.shape
    flat = moved.reshape(rows, -1)
    largest = float(np.abs(flat).max(initial=0.0))
    if largest == 0.0:
        return [], np.zeros((rows, 0)), 0.0
    left, size, right = np.linalg.svd(flat, full_matrices=False)
    count = min(_FIELDS, int(np.sum(size > _NOTHING * size[0])))
    weights, fields = left[:, :count] * size[:count], right[:count]
    error = float(np.abs(weights @ fields - flat).max()) / largest
    scale = np.abs(weights).max(axis=0)
    return [scale[k] * fields[k].reshape(points, 3) for k in range(count)], weights / scale, error
