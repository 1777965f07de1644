"""Displacement and stress over the whole piece at given elongations, for a picture."""

import numpy as np

from hfsa.components._continuum.design import Continuum
from hfsa.components._continuum.elements import corner_stress, von_mises
from hfsa.components._continuum.piece import as_leg_2, turn
from hfsa.components._modelling.deformation import Deformation


def deformed(design: Continuum, elongation: np.ndarray) -> Deformation:
    """Return the piece at elongations (3,) [m], in the axes of the stage."""
    stage, (mesh, piece) = (solved := design.solved(design.size)).stage, solved.solution
    motion = np.concatenate([elongation, stage.statics.jacobian @ elongation])
    interface = stage.statics.interface @ motion
    every = np.arange(len(mesh.triangles))
    points, displacements, stresses = [], [], []
    for leg, push in enumerate(stage.pushes):
        to_stage = turn(np.arctan2(push[0], -push[1]))
        own = piece.shapes @ interface[as_leg_2(leg)]
        points.append(mesh.points @ to_stage.T)
        displacements.append(own.reshape(-1, 2) @ to_stage.T)
        stresses.append(von_mises(corner_stress(mesh, every, own, design.shape.plate), design.shape.plate))
    triangles = np.vstack([mesh.triangles + leg * len(mesh.points) for leg in range(len(points))])
    at = ", ".join(f"{1e6 * value:.4g}" for value in elongation)
    title = f"3-RRR stage, contact {design.contact}, bolts {design.bolts}, elongations {at} um"
    return Deformation(title, np.vstack(points), triangles, np.vstack(displacements), np.vstack(stresses))
