"""fmpy, `simulate_fmu` with a table of inputs and `simulate_ssp`: inputs are linear in time in Model Exchange only."""

INSTALL = ["fmpy"]
PACKAGE = "fmpy"
OFFERS = {(2, "CS"): "held", (2, "ME"): "linear", (3, "CS"): "held", (3, "ME"): "linear", (2, "SSP"): "zero first"}
REMARKS = {
    (2, "ME"): "its fault: inputs move at output points only, and its integrator is not restarted there",
    (3, "ME"): "its fault, as in FMI 2",
    (3, "SSP"): "its packages are of FMI 2",
}


def run(task):
    import numpy as np
    from fmpy import simulate_fmu
    from fmpy.ssp.simulation import simulate_ssp

    if task.interface == "SSP":
        found = simulate_ssp(task.file, stop_time=(task.steps - 0.5) * task.step_size, step_size=task.step_size)
        return np.array([found[name] for name in task.outputs]).T
    found = simulate_fmu(
        task.file,
        fmi_type={"CS": "CoSimulation", "ME": "ModelExchange"}[task.interface],
        input=task.table if task.inputs else None,
        output=task.outputs,
        step_size=task.step_size,
        output_interval=task.step_size,
        stop_time=task.steps * task.step_size,
        relative_tolerance=1e-6,
    )
    rows = np.searchsorted(found["time"], task.times[1:] - 1e-3 * task.step_size)
    return np.array([found[name][rows] for name in task.outputs]).T
