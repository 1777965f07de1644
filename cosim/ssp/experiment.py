"""What a package says of its simulation: times, the step of the tool that wrote it, and annotations."""

from hfsa.cosim.archives.xml import Node, number
from hfsa.cosim.ssp.structure import Experiment
from hfsa.cosim.ssp.vocabulary import HFSA, OFFERED, OMS, OPEN_MODELICA, OPEN_SIMULATION_PLATFORM, OSP, OURS, SSC, SSD

_STEPS = (
    (f"{{{OSP}}}FixedStepAlgorithm", "baseStepSize"),
    (f"{{{OMS}}}FixedStepMaster", "stepSize"),
    (f"{{{OMS}}}SimulationInformation", "fixedStepSize"),
    (f"{{{SSD}}}FixedStepMaster", "stepSize"),
)
"""Nodes and attributes with a communication step size, the most specific first."""


def read_experiment(root: Node, where: str) -> Experiment:
    """Return the experiment of a document."""
    node = root.find(f"{{{SSD}}}DefaultExperiment")
    start = 0.0 if node is None else number(node, "startTime", 0.0, where)
    stop = None if node is None or node.get("stopTime") is None else number(node, "stopTime", 0.0, where)
    types = [annotation.get("type") or "" for annotation in root.iter(f"{{{SSC}}}Annotation")]
    foreign = dict.fromkeys(
        kind for kind in types if kind not in (OURS, OFFERED, OPEN_SIMULATION_PLATFORM, OPEN_MODELICA)
    )
    if root.find(f".//{{{OSP}}}StepSizeHint") is not None:
        foreign[f"{OPEN_SIMULATION_PLATFORM} (StepSizeHint)"] = None
    ours = next((scene.text or "" for scene in root.iter(f"{{{HFSA}}}Scene")), None)
    return Experiment(start, stop, _step_size(root, where), ours, tuple(foreign))


def _step_size(root: Node, where: str) -> float | None:
    """Return the communication step size that a tool has written, if any."""
    for tag, name in _STEPS:
        for node in root.iter(tag):
            if node.get(name):
                return number(node, name, 0.0, where)
    return None
