"""Sizes that several parts of the machine know."""

MASS = 2.0
"""Moving mass [kg]."""

STIFFNESS = 2e4
"""Stiffness of the leaf springs along the stage's motion [N/m]."""

MOTOR_CONSTANT = 20.0
"""Force per current of the voice coil [N/A]."""
