"""ecos, a Co-Simulation master: inputs are set from outside between its steps."""

INSTALL = ["ecospy>=0.7", "tbb"]
PACKAGE = "ecospy"
OFFERS = {(2, "CS"): "held", (3, "CS"): "held", (2, "SSP"): "plain", (3, "SSP"): "plain"}
REMARKS = {(2, "ME"): "a master of Co-Simulation", (3, "ME"): "a master of Co-Simulation"}


def _simulation(task):
    import ctypes
    import sys
    from pathlib import Path

    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), ctypes.RTLD_GLOBAL)
    import ecospy

    if task.interface == "SSP":
        simulation = ecospy.EcosSimulation(task.step_size, ssp_path=task.file)
        simulation.init(parameter_set="start")
        return simulation, [name.replace(".", "::", 1) for name in task.outputs]
    structure = ecospy.EcosSimulationStructure()
    structure.add_model("fmu", task.file)
    simulation = ecospy.EcosSimulation(task.step_size, structure=structure)
    simulation.init()
    return simulation, [f"fmu::{name}" for name in task.outputs]


def run(task):
    simulation, outputs = _simulation(task)
    rows = []
    for values in task.values[:-1]:
        for name, value in zip(task.inputs, values, strict=True):
            simulation.set_real(f"fmu::{name}", float(value))
        simulation.step()
        rows.append([simulation.get_real(name) for name in outputs])
    return rows
