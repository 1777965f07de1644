"""CasADi functions of the equations of a model, for code generation and linearisation.

The first five arguments of all functions are the columns time t, continuous states x, sampled states z, inputs u and
parameters p, each in the order of declaration. A mass-matrix equation M(t,x,z,u,p) a = h(t,x,z,u,p) is solved inside
the functions by LDL^T factorisation. Its derivatives follow from the implicit function theorem,
d a = M^-1 (dh - dM a), without an explicit inverse.
"""

from dataclasses import dataclass
from functools import partial

import casadi as ca

from hfsa.components._modelling.model import Kind, Model


@dataclass(frozen=True)
class Functions:
    """The functions of one model; all results except `jacobian` are columns.

    Attributes:
        rhs: (t, x, z, u, p) -> der(x).
        out: (t, x, z, u, p) -> outputs.
        tick: (t, x, z, u, p) -> next(z), sampled outputs.
        jacobian: (t, x, z, u, p) -> d der(x) / dx, sparse.
        fwd: (t, x, z, u, p, dt, dx, dz, du, dp) -> directional derivatives of der(x), outputs, next(z), sampled
            outputs.
        adj: (t, x, z, u, p, and weights of der(x), outputs, next(z), sampled outputs) -> gradients of the weighted sum
            with respect to t, x, z, u, p.
        is_linear: whether der(x) is affine in x and u, with coefficients that depend on parameters only.
    """

    rhs: ca.Function
    out: ca.Function
    tick: ca.Function
    jacobian: ca.Function
    fwd: ca.Function
    adj: ca.Function
    is_linear: bool

    def __iter__(self):
        return iter((self.rhs, self.out, self.tick, self.jacobian, self.fwd, self.adj))


ARGUMENTS = ("t", "x", "z", "u", "p")
RESULTS = ("der", "out", "next", "held")


def functions(model: Model) -> Functions:
    """Return the functions of a complete model; raise `ModelError` for an incomplete one, as `Model.check`."""
    model.check()
    v = [
        model.time,
        model.symbols(Kind.STATE),
        model.symbols(Kind.SAMPLED_STATE),
        model.symbols(Kind.INPUT),
        model.symbols(Kind.PARAMETER),
    ]
    column = partial(ca.vertcat, ca.SX(0, 1))
    results = [
        column(*[model.der[q.name] for q in model.of(Kind.STATE)]),
        column(*[q.expression for q in model.of(Kind.OUTPUT)]),
        column(*[model.next[q.name] for q in model.of(Kind.SAMPLED_STATE)]),
        column(*[q.expression for q in model.of(Kind.SAMPLED_OUTPUT)]),
    ]
    build = _implicit if model.motions else _explicit
    return Functions(*build(model, v, results), is_linear=is_linear(model))


def _explicit(_: Model, v: list[ca.SX], results: list[ca.SX]) -> list[ca.Function]:
    """Return all functions as SX functions, common subexpressions removed."""
    der, out, nxt, held = results
    seeds, weights = _like(v, "d"), _like(results, "w")
    forward = [ca.jtimes(r, ca.vertcat(*v), ca.vertcat(*seeds)) for r in results]
    gradient = ca.jtimes(ca.vertcat(*results), ca.vertcat(*v), ca.vertcat(*weights), True)
    return [
        _function("rhs", v, [der], RESULTS[:1]),
        _function("out", v, [out], RESULTS[1:2]),
        _function("tick", v, [nxt, held], RESULTS[2:]),
        _function("jacobian", v, [ca.jacobian(der, v[1])], ("jacobian",)),
        _function("fwd", v + seeds, forward, RESULTS),
        _function("adj", v + weights, _split(gradient, v), ARGUMENTS),
    ]


def _implicit(model: Model, v: list[ca.SX], results: list[ca.SX]) -> list[ca.Function]:
    """Return all functions as MX functions: SX kernels of M, h, results and residual h - M a, joined by LDL^T solves.

    The generated C evaluates a kernel as a whole, so a kernel contains only expressions that are needed together.
    """
    M = ca.diagcat(*[motion.mass for motion in model.motions])
    h = ca.vertcat(*[motion.force for motion in model.motions])
    a = ca.vertcat(*[motion.acceleration for motion in model.motions])
    residual = h - M @ a
    stacked, every = ca.vertcat(*v), ca.vertcat(*v, a)
    seeds, weights, da = _like(v, "d"), _like(results, "w"), ca.SX.sym("da", a.shape[0])
    lam = ca.SX.sym("lam", a.shape[0])

    sides = _function("sides", v, [M, h], ("M", "h"))
    der = _function("derivatives", [*v, a], results[:1], RESULTS[:1])
    out = _function("outputs", [*v, a], results[1:2], RESULTS[1:2])
    ticked = _function("ticked", [*v, a], results[2:], RESULTS[2:])
    slopes = _function(
        "slopes",
        [*v, a],
        [ca.jacobian(results[0], v[1]), ca.jacobian(results[0], a), ca.jacobian(residual, v[1])],
        ("d_x", "d_a", "r_x"),
    )
    residual_fwd = _function(
        "residual_fwd", [*v, a, *seeds], [ca.jtimes(residual, stacked, ca.vertcat(*seeds))], ("r",)
    )
    values_fwd = _function(
        "values_fwd", [*v, a, *seeds, da], [ca.jtimes(r, every, ca.vertcat(*seeds, da)) for r in results], RESULTS
    )
    gradient = ca.jtimes(ca.vertcat(*results), every, ca.vertcat(*weights), True)
    values_adj = _function("values_adj", [*v, a, *weights], _split(gradient, [*v, a]), (*ARGUMENTS, "a"))
    residual_adj = _function(
        "residual_adj", [*v, a, lam], _split(ca.jtimes(residual, stacked, lam, True), v), ARGUMENTS
    )

    V = [ca.MX.sym(name, s.shape[0]) for name, s in zip(ARGUMENTS, v, strict=True)]
    dV = [ca.MX.sym(f"d{name}", s.shape[0]) for name, s in zip(ARGUMENTS, v, strict=True)]
    W = [ca.MX.sym(f"w_{name}", s.shape[0]) for name, s in zip(RESULTS, results, strict=True)]
    mass, force = sides(*V)
    solve = partial(ca.solve, mass)
    acc = solve(force, "ldl")
    d_x, d_a, r_x = slopes(*V, acc)
    forward = values_fwd(*V, acc, *dV, solve(residual_fwd(*V, acc, *dV), "ldl"))
    *direct, a_bar = values_adj(*V, acc, *W)
    through = residual_adj(*V, acc, solve(a_bar, "ldl"))
    return [
        _function("rhs", V, [der(*V, acc)], RESULTS[:1]),
        _function("out", V, [out(*V, acc)], RESULTS[1:2]),
        _function("tick", V, list(ticked(*V, acc)), RESULTS[2:]),
        _function("jacobian", V, [d_x + d_a @ solve(r_x, "ldl")], ("jacobian",)),
        _function("fwd", V + dV, list(forward), RESULTS),
        _function("adj", V + W, [d + t for d, t in zip(direct, through, strict=True)], ARGUMENTS),
    ]


def is_linear(model: Model) -> bool:
    """Return whether der = A(p) x + B(p) u + c(z, p), with a mass matrix that depends on parameters only."""
    t = model.time
    x, z, u = (model.symbols(kind) for kind in (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT))
    der = ca.vertcat(ca.SX(0, 1), *[model.der[q.name] for q in model.of(Kind.STATE)])
    moving = ca.vertcat(t, x, z, u)
    a = ca.vertcat(ca.SX(0, 1), *[motion.acceleration for motion in model.motions])
    sides = [der, *[motion.force for motion in model.motions]]
    if any(ca.depends_on(motion.mass, moving) for motion in model.motions):
        return False
    if any(ca.depends_on(side, t) for side in sides):
        return False
    slopes = [ca.jacobian(side, ca.vertcat(x, u, a)) for side in sides]
    return not any(ca.depends_on(ca.vec(slope), ca.vertcat(moving, a)) for slope in slopes)


def _function(name: str, arguments: list, results: list, result_names: tuple[str, ...]) -> ca.Function:
    """Return a CasADi function with labelled results; SX expressions share common subexpressions."""
    if isinstance(arguments[0], ca.SX):
        results = ca.cse([ca.SX(r) for r in results])
    labels = [f"i{k}" for k in range(len(arguments))]
    return ca.Function(name, arguments, results, labels, [f"o_{label}" for label in result_names])


def _like(columns: list[ca.SX], prefix: str) -> list[ca.SX]:
    """Return new symbols with the shapes of columns."""
    return [ca.SX.sym(f"{prefix}{k}", column.shape[0]) for k, column in enumerate(columns)]


def _split(stacked: ca.SX, parts: list[ca.SX]) -> list[ca.SX]:
    """Return the blocks of a stacked column, with the lengths of `parts`."""
    offsets = [0]
    for part in parts:
        offsets.append(offsets[-1] + part.shape[0])
    return ca.vertsplit(stacked, offsets) if offsets[-1] else [ca.SX(0, 1) for _ in parts]
