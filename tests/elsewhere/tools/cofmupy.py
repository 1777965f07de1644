"""CoFMPy (cofmupy), a Co-Simulation master of JSON files: inputs are literal series, held between their points."""

INSTALL = ["cofmupy"]
PACKAGE = "cofmupy"
OFFERS = {(2, "CS"): "held", (3, "CS"): "held"}
REMARKS = {(2, "ME"): "a master of Co-Simulation", (3, "ME"): "a master of Co-Simulation"}


def run(task):
    import json
    import os
    import tempfile
    from pathlib import Path

    from cofmupy.coordinator import Coordinator

    connections = [
        {
            "source": {
                "type": "literal",
                # its time is a sum, which may end a little below a point of the series
                "values": {str(t - 1e-6 * task.step_size): v for t, v in zip(task.times.tolist(), column, strict=True)},
                "interpolation": "previous",
            },
            "target": {"id": "fmu", "variable": name},
        }
        for name, column in zip(task.inputs, task.values.T.tolist(), strict=True)
    ]
    configuration = {
        "fmus": [{"id": "fmu", "path": task.file, "name": "fmu"}],
        "connections": connections,
        "cosim_method": "jacobi",
        "iterative": False,
        "root": "",
    }
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        file = Path(name) / "configuration.json"
        file.write_text(json.dumps(configuration))
        coordinator = Coordinator()
        coordinator.start(str(file))
        rows = []
        for _ in range(task.steps):
            coordinator.do_step(task.step_size)
            outputs = coordinator.master.get_outputs()["fmu"]
            rows.append([outputs[output][0] for output in task.outputs])
    return rows
