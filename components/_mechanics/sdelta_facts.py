"""Shared facts of the parts around one SDelta robot."""

from hfsa.components._modelling.facts import Fact

POSTURE = Fact("posture of the SDelta")
PAYLOAD = Fact("payload of the SDelta")
SPRINGS = Fact("stiffness of the SDelta")
DAMPING_RATIO = Fact("damping ratio of the SDelta", "1")
GRAVITY = Fact("gravity on the SDelta", "m/s2")
