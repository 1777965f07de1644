"""Shared facts of the parts around one SDelta robot."""

from hfsa.components._modelling.facts import Fact

POSTURE = Fact("posture of the SDelta")
PAYLOAD = Fact("payload of the SDelta")
PLATFORM = Fact("platform of the SDelta")
GEOMETRY = Fact("geometry of the SDelta")
PITCH = Fact("screw pitch of the SDelta", "m")
GEAR = Fact("gear reduction of the SDelta", "1")
RODS = Fact("rods of the SDelta")
SHAFTS = Fact("shafts of the SDelta")
LIMBS = Fact("inertia of the limbs of the SDelta")
SPRINGS = Fact("stiffness of the SDelta")
DAMPING_MODEL = Fact("damping model of the SDelta")
DAMPING_RATIO = Fact("damping ratio of the SDelta", "1")
GRAVITY = Fact("gravity on the SDelta", "m/s2")
