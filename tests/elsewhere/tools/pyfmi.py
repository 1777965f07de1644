"""PyFMI: `simulate` with a table of inputs, linear in time in Model Exchange."""

INSTALL = ["PyFMI"]
PACKAGE = "PyFMI"
OFFERS = {(2, "CS"): "held", (2, "ME"): "linear", (3, "ME"): "linear"}
MISSING = "PyPI has only sources of old versions, which need FMI Library and a compiler"
REMARKS = {(3, "CS"): "has no Co-Simulation of FMI 3"}


def run(task):
    import numpy as np
    from pyfmi import load_fmu

    model = load_fmu(task.file, kind=task.interface, log_level=0)
    options = model.simulate_options()
    options["ncp"] = task.steps
    options["result_handling"] = "memory"
    if task.interface == "ME":
        options["CVode_options"]["rtol"] = 1e-8
    table = np.column_stack([task.times, task.values])
    found = model.simulate(
        final_time=task.times[-1], input=(task.inputs, table) if task.inputs else (), options=options
    )
    rows = np.searchsorted(found["time"], task.times[1:] - 1e-3 * task.step_size)
    return np.array([found[name][rows] for name in task.outputs]).T
