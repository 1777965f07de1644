"""OMSimulator: packages; it passes values through all FMUs with direct feedthrough before each step."""

INSTALL = ["OMSimulator"]
PACKAGE = "OMSimulator"
OFFERS = {(2, "SSP"): "through"}
MISSING = "PyPI has only a source package, whose installation downloads a binary from elsewhere"
REMARKS = {(3, "SSP"): "its fault: takes value references of FMI 3 for positions"}


def run(task):
    from OMSimulator import SSP, CRef

    model = SSP(task.file).instantiate()
    model.setResultFile("")
    model.setStopTime(task.steps * task.step_size)
    model.initialize()
    rows = []
    for _ in range(task.steps):
        model.doStep()
        rows.append([model.getValue(CRef("model", *name.split(".", 1))) for name in task.outputs])
    model.terminate()
    model.delete()
    return rows
