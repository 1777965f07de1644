"""fmuloader, bindings of all functions of FMI 2 and 3: our own loop of `do_step` on them."""

INSTALL = ["fmuloader>=0.1.2rc0"]
PACKAGE = "fmuloader"
OFFERS = {(2, "CS"): "held", (3, "CS"): "held"}
REMARKS = {
    (2, "ME"): "has no integrator",
    (3, "ME"): "has no integrator",
}


def run(task):
    return (_run2 if task.fmi == 2 else _run3)(task)


def _run2(task):
    from fmuloader.fmi2 import Fmi2Slave, Fmi2Type

    fmu = Fmi2Slave(task.file, model_identifier=task.name)
    fmu.instantiate("fmu", Fmi2Type.CO_SIMULATION, guid=task.token)
    fmu.setup_experiment(0.0)
    return _loop(task, fmu, fmu.set_real, fmu.get_real)


def _run3(task):
    from fmuloader.fmi3 import Fmi3Slave

    fmu = Fmi3Slave(task.file, model_identifier=task.name)
    fmu.instantiate_co_simulation("fmu", instantiation_token=task.token)
    return _loop(task, fmu, fmu.set_float64, fmu.get_float64)


def _loop(task, fmu, setter, getter):
    inputs = [task.references[name] for name in task.inputs]
    outputs = [task.references[name] for name in task.outputs]
    fmu.enter_initialization_mode()
    fmu.exit_initialization_mode()
    rows = []
    for time, values in zip(task.times[:-1], task.values, strict=False):
        if inputs:
            setter(inputs, [float(value) for value in values])
        fmu.do_step(float(time), task.step_size)
        rows.append(getter(outputs))
    fmu.terminate()
    fmu.free_instance()
    return rows
