"""Fidelity that a scene requires: levels of components, their errors, and the effects of amplitudes and steps.

Read `levels.py` first. It imports `assembly` and what is below it.
"""
