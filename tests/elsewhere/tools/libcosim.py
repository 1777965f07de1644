"""libcosim, a Co-Simulation master: inputs are overridden between its steps."""

INSTALL = ["libcosimpy>=0.0.6"]
PACKAGE = "libcosimpy"
OFFERS = {(2, "CS"): "held", (2, "SSP"): "plain"}
REMARKS = {
    (2, "ME"): "a master of Co-Simulation",
    (3, "CS"): "has no FMI 3",
    (3, "ME"): "has no FMI 3",
    (3, "SSP"): "has no FMI 3",
}


def run(task):
    return (_package if task.interface == "SSP" else _fmu)(task)


def _fmu(task):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(round(task.step_size * 1e9))
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    execution.add_observer(observer)
    execution.add_manipulator(manipulator)
    slave = execution.add_local_slave(CosimLocalSlave(task.file, "fmu"))
    inputs = [task.references[name] for name in task.inputs]
    outputs = [task.references[name] for name in task.outputs]
    rows = []
    for values in task.values[:-1]:
        if inputs:
            manipulator.slave_real_values(slave, inputs, [float(value) for value in values])
        if not execution.step():
            raise RuntimeError("the step failed")
        rows.append(list(observer.last_real_values(slave, outputs)))
    return rows


def _package(task):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution = CosimExecution.from_ssp_file(task.file)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    slaves = {info.name.decode(): info.index for info in execution.slave_infos()}
    places = [(slaves[name.partition(".")[0]], task.references[name]) for name in task.outputs]
    rows = []
    for _ in range(task.steps):
        if not execution.step():
            raise RuntimeError("the step failed")
        rows.append([observer.last_real_values(slave, [reference])[0] for slave, reference in places])
    return rows
