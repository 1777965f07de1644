"""SciPy's LSODA on the calls of fmpy, an importer of Model Exchange of fifty lines, restarted at each step."""

INSTALL = ["scipy", "fmpy"]
PACKAGE = "scipy"
OFFERS = {(2, "ME"): "linear", (3, "ME"): "linear"}
REMARKS = {
    (2, "ME"): "`tests/model_exchange_loop.py`, relative tolerance 1e-10",
    (3, "ME"): "`tests/model_exchange_loop.py`, relative tolerance 1e-10",
}


def run(task):
    from model_exchange_loop import simulated

    return simulated(task.file, task.inputs, task.outputs, task.values, task.step_size, linear=True)
