"""Cost of a right-hand side of the robot by level, generated code beside C written by hand for the same equations.

    python tests/benchmarks/robot.py

Both are compiled as FMUs are, at the symmetric posture with the preset ch4. The time is the shortest of several rounds,
in turn; the difference is the largest of any derivative, relative to the largest of its column.
"""

import ctypes
import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.modes import damping_matrix, damping_rates
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix
from hfsa.components._mechanics.sdelta_geometry import C_AXES, SYMMETRIC, THESIS_GEOMETRY
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_robot import Machine, Robot
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.sdelta import sdelta
from hfsa.fmus.compile import compile_files

LEVELS = ("cartesian", "generalized", "nonlinear")
COUNT, ROUNDS = 20_000, 25
DOUBLES = ctypes.POINTER(ctypes.c_double)


def numbers() -> str:
    """Constants of the C written by hand."""
    robot = Robot.at(SYMMETRIC, "ch4", CUBE, Machine())
    shafts = Robot.at(SYMMETRIC, "ch4_full", CUBE, Machine())
    K, M, D = robot.stiffness, robot.mass, damping_matrix(robot.mass, robot.stiffness)
    T = robot.kinematics.tubes_to_pose(robot.offset)
    M_E = mass_matrix(shafts)
    omega, shapes = generalized_modes(shafts, M_E)
    G = shapes.T @ M_E[:, :6] @ np.linalg.inv(shafts.machine.mechanism.drives_matrix)
    limbs, arms = robot.kinematics.limbs, THESIS_GEOMETRY.joints
    scalars = {
        "CENTER": robot.offset[2], "MASS": robot.body.mass, "I11": M[0, 0], "I33": M[2, 2],
        "K11": K[0, 0], "K33": K[2, 2], "K44": K[3, 3], "K66": K[5, 5], "K24": K[1, 3],
        "D11": D[0, 0], "D33": D[2, 2], "D44": D[3, 3], "D66": D[5, 5], "D24": D[1, 3],
        "STIFFNESS": robot.springs.rod, "LENGTH": limbs.length[0],
        "SIN": np.sin(limbs.angle[0]), "COS": np.cos(limbs.angle[0]),
    }  # fmt: skip
    arrays = {
        "MINUS_T": -T, "MINUS_D_T": -(D @ T).T, "MINUS_G": -G, "W_T": (shafts.of_limbs @ shapes).T,
        "OMEGA2": omega**2, "RATE": damping_rates(omega, "modal"),
        "AXIS_X": C_AXES[:, 0], "AXIS_Y": C_AXES[:, 1], "ARM_X": arms[:, 0], "ARM_Y": arms[:, 1],
    }  # fmt: skip
    lines = [f"static const double {name} = {float(value)!r};" for name, value in scalars.items()]
    for name, values in arrays.items():
        entries = ", ".join(repr(float(value)) for value in np.ravel(values))
        lines.append(f"static const double {name}[] = {{{entries}}};")
    return "\n".join(lines) + "\n"


def compiled(models: dict[str, Model], folder: Path) -> ctypes.CDLL:
    """Library of the timer, the generated functions and those by hand."""
    here = Path(__file__).parent
    files = {"numbers.h": numbers(), "robot.c": (here / "robot.c").read_text()}
    files["robot_timer.c"] = (here / "robot_timer.c").read_text()
    for level, model in models.items():
        options = {"casadi_real": "double", "casadi_int": "int", "static_aux": True}
        generator = ca.CodeGenerator(f"{level}.c", options)
        generator.add(functions(model).rhs)
        files[f"{level}.c"] = generator.dump().replace(" rhs", f" {level}_rhs")
    compile_files(files, folder / "robot.so", flags=["-fvisibility=default", "-Wno-unused-function"])
    return ctypes.CDLL(str(folder / "robot.so"))


def column(values: np.ndarray):
    """Pointer to doubles."""
    return values.ctypes.data_as(DOUBLES)


def main() -> None:
    models = {level: sdelta(level=level) for level in LEVELS}
    print("level         generated [us]  by hand [us]  ratio  instructions  difference")
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(models, Path(folder))
        library.time_hand.restype = library.time_generated.restype = ctypes.c_double
        for level, model in models.items():
            random, rhs = np.random.default_rng(1), functions(model).rhs
            x = np.array([1e-3 * random.normal() for _ in model.of(Kind.STATE)])
            u = np.array([1e-3 * random.normal() for _ in model.of(Kind.INPUT)])
            p = np.array([q.start for q in model.of(Kind.PARAMETER)])
            p[1] = 9.81
            mine, theirs, work = np.zeros(len(x)), np.zeros(len(x)), np.zeros(rhs.sz_w())
            by_hand, generated = getattr(library, level), getattr(library, f"{level}_rhs")
            best = [np.inf, np.inf]
            for _ in range(ROUNDS):
                times = (
                    library.time_generated(generated, *map(column, (x, u, p, theirs, work)), COUNT),
                    library.time_hand(by_hand, *map(column, (x, u, p, mine)), COUNT),
                )
                best = [min(b, t) for b, t in zip(best, times, strict=True)]
            off = np.abs(mine - theirs).max() / np.abs(theirs).max()
            ours, hand = (1e6 * b / COUNT for b in best)
            print(f"{level:12}  {ours:14.3f}  {hand:12.3f}  {ours / hand:5.2f}  {rhs.n_instructions():12}  {off:10.1e}")


if __name__ == "__main__":
    main()
