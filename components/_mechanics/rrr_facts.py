"""Shared facts of the parts around one 3-RRR stage and its stacks."""

from hfsa.components._modelling.facts import Fact, Known

KINEMATICS = Fact("kinematics of the stage")
LINKS = Fact("links of the stage")
HINGE = Fact("hinges of the stage")
MASSES = Fact("masses of the stage")
JACOBIAN = Fact("Jacobian of the stage")
STIFFNESS = Fact("stiffness of the stage", "N/m")
MASS = Fact("inertia of the stage", "kg")
DAMPING_TIME = Fact("damping time of the stage", "s")
STACK_STIFFNESS = Fact("stiffness of the stacks", "N/m")
STACK_COUPLING = Fact("force per volt of the stacks", "N/V")
STACK_STROKE = Fact("free stroke of the stacks", "m")
STACK_VOLTAGE = Fact("full voltage of the stacks", "V")

GEOMETRY = {KINEMATICS: Known("kinematics"), LINKS: Known("links"), JACOBIAN: Known("jacobian")}
"""What a part with a kinematic model of the stage knows, by its arguments."""
STAGE = {
    **GEOMETRY,
    HINGE: Known("hinge"),
    MASSES: Known("masses"),
    STIFFNESS: Known("stiffness"),
    MASS: Known("mass"),
}
"""What a part with a dynamic model of the stage knows, by its arguments."""
