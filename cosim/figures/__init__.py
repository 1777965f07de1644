"""Figures of results: Bode plots, comparisons, maps.

Read `bode.py` first. It imports `results` and `signals`, and no FMU.
"""
