"""Shared facts of a body and the beam suspension whose terminal `platform` it is connected to.

A suspension whose terminal `base` is connected to the body may carry another body with other values.
"""

from hfsa.components._modelling.facts import Fact

BODY_MASS = Fact("mass of the body on the beams", "kg", terminal="platform")
BODY_INERTIA = Fact("inertia of the body on the beams", "kg.m2", terminal="platform")
BODY_CENTER = Fact("mass centre of the body on the beams", "m", terminal="platform")
