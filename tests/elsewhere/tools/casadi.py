"""CasADi's `DaeBuilder`: the FMU as functions of time, states and inputs, solved by its CVODES with held inputs."""

INSTALL = ["casadi>=3.8"]
PACKAGE = "casadi"
OFFERS = {(2, "ME"): "held", (3, "ME"): "held"}
REMARKS = {
    (2, "CS"): "takes Model Exchange",
    (3, "CS"): "takes Model Exchange",
    (2, "ME"): "no time events, so no ticks",
    (3, "ME"): "its limit: no text variables of FMI 3",
}


def run(task):
    import tempfile
    import zipfile

    import casadi as ca
    import numpy as np

    if task.has_events:
        raise NotImplementedError("its integrators know no time events, so no ticks")
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(task.file).extractall(folder)
        dae = ca.DaeBuilder(task.name, folder)
        places = [list(dae.u()).index(name) for name in task.inputs]
        named = list(dae.y())
        exits = [named.index(name) for name in task.outputs]
        outputs = dae.create("y", ["t", "x", "u", "p"], ["y"])
        p = np.array([dae.start(name)[0] for name in dae.p()])
        x = np.array([dae.start(name)[0] for name in dae.x()])
        step = _step(dae, task, len(x), len(places), len(p))
        rows = []
        for k, values in enumerate(task.values[:-1]):
            u = np.zeros(len(places))
            u[places] = values
            x = step(x, u, p, k * task.step_size)
            rows.append(np.array(outputs((k + 1) * task.step_size, x, u, p)).ravel()[exits])
    return rows


def _step(dae, task, n, m, q):
    """Return the map of the states over one step."""
    import casadi as ca

    if n == 0:
        return lambda x, *_: x
    rates = dae.create("rates", ["t", "x", "u", "p"], ["ode"])
    t, x, u, p, start = (ca.MX.sym(name, size) for name, size in zip("txups", (1, n, m, q, 1), strict=True))
    problem = {"t": t, "x": x, "p": ca.vertcat(u, p, start), "ode": rates(t + start, x, u, p)}
    options = {"reltol": 1e-9, "abstol": 1e-16, "max_num_steps": 100000}
    solver = ca.integrator("step", "cvodes", problem, 0.0, task.step_size, options)
    return lambda x, u, p, time: solver(x0=x, p=ca.vertcat(u, p, time))["xf"]
