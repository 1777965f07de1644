"""Facts on which a body and the beam suspension whose `platform` it is must agree.

A suspension that hangs on the body by its `base` may carry another one.
"""

from hfsa.components._modelling.facts import Fact

BODY_MASS = Fact("mass of what the beams carry", "kg", terminal="platform")
BODY_INERTIA = Fact("inertia of what the beams carry", "kg.m2", terminal="platform")
BODY_CENTER = Fact("mass centre of what the beams carry", "m", terminal="platform")
