"""Linearised FMUs: connected systems of their directional derivatives, and the linear map of each action of a step.

Read `linearize.py`, then `cycle.py`. It imports `actions` and what is below it.
"""
