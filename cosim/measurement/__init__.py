"""Measurements on FMUs: an input at one frequency, a frequency sweep, a run in time, tasks in worker processes.

Read `rig.py` first. It imports `masters`, `analysis`, `results` and what is below them.
"""
