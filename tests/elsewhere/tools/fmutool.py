"""fmutool (fmu-manipulation-toolbox): a package becomes a container FMU, which fmpy steps."""

INSTALL = ["fmu-manipulation-toolbox>=2", "fmpy"]
PACKAGE = "fmu-manipulation-toolbox"
OFFERS = {(2, "SSP"): "plain", (3, "SSP"): "plain"}
REMARKS = {(fmi, interface): "makes containers of packages" for fmi in (2, 3) for interface in ("CS", "ME")}


def run(task):
    import os
    import shutil
    import tempfile
    from pathlib import Path

    import numpy as np
    from fmpy import simulate_fmu
    from fmu_manipulation_toolbox.assembly import Assembly

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chdir(folder)  # its log is written here
        shutil.copy(task.file, folder / "model.ssp")
        Assembly("model.ssp", default_step_size=task.step_size, fmu_directory=folder).make_fmu(fmi_version=task.fmi)
        found = simulate_fmu(
            folder / "model.fmu",
            fmi_type="CoSimulation",
            step_size=task.step_size,
            output_interval=task.step_size,
            stop_time=task.steps * task.step_size,
            output=[f"model.{output}" for output in task.outputs],
        )
        return np.array([found[f"model.{output}"][1:] for output in task.outputs]).T
