"""pathsim with pathsim-fmi: blocks of an FMU between sources and a recorder."""

INSTALL = ["pathsim-fmi"]
PACKAGE = "pathsim-fmi"
OFFERS = {(2, "CS"): "held", (3, "CS"): "held", (2, "ME"): "linear", (3, "ME"): "linear"}
REMARKS = {
    (2, "ME"): "explicit solver; its fault: an FMU without states gives no number",
    (3, "ME"): "explicit solver; its fault: an FMU without states gives no number",
}


def run(task):
    return (_cosimulation if task.interface == "CS" else _model_exchange)(task)


def _sources(task):
    import numpy as np
    from pathsim.blocks import Source

    times, values = task.times, task.values
    return [Source(lambda t, k=k: float(np.interp(t, times, values[:, k]))) for k in range(len(task.inputs))]


def _order(block, task):
    """Return the places of inputs and of outputs at the ports of a block, which are in the order of the description."""
    description = block.fmu_wrapper.model_description
    named = {"input": [], "output": []}
    for variable in description.modelVariables:
        if variable.causality in named:
            named[variable.causality].append(variable.name)
    return [named["input"].index(name) for name in task.inputs], [named["output"].index(name) for name in task.outputs]


def _cosimulation(task):
    """Steps are scheduled events of the block: each takes the inputs of its own beginning."""
    from pathsim_fmi import CoSimulationFMU

    block = CoSimulationFMU(task.file, dt=task.step_size)
    entries, exits = _order(block, task)
    rows = []
    for time, values in zip(task.times[:-1], task.values, strict=False):
        for entry, value in zip(entries, values, strict=True):
            block.inputs[entry] = value
        block._step_fmu(float(time))
        rows.append(block.outputs.to_array()[exits])
    return rows


def _model_exchange(task):
    import numpy as np
    from pathsim import Connection, Simulation
    from pathsim.solvers import RKDP54
    from pathsim_fmi import ModelExchangeFMU

    block, sources = ModelExchangeFMU(task.file), _sources(task)
    entries, exits = _order(block, task)
    connections = [Connection(source, block[entry]) for source, entry in zip(sources, entries, strict=True)]
    simulation = Simulation(
        [*sources, block],
        connections,
        dt=task.step_size,
        log=False,
        Solver=RKDP54,
        tolerance_lte_rel=1e-8,
        tolerance_lte_abs=1e-14,
    )
    rows = []
    for _ in range(task.steps):
        simulation.run(task.step_size, reset=False, adaptive=True)
        rows.append(np.array(block.outputs.to_array())[exits])
    return rows
