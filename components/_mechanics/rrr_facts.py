"""Shared facts of the parts around one 3-RRR stage and its stacks."""

from hfsa.components._modelling.facts import Fact

KINEMATICS = Fact("kinematics of the stage")
DAMPING_TIME = Fact("damping time of the stage", "s")
STACK_STIFFNESS = Fact("stiffness of the stacks", "N/m")
STACK_COUPLING = Fact("force per volt of the stacks", "N/V")
STACK_STROKE = Fact("free stroke of the stacks", "m")
STACK_VOLTAGE = Fact("full voltage of the stacks", "V")
