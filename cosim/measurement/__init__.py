"""One measurement on FMUs: an input at one frequency, a run in time, a point of a sweep in a process of its own.

Read `rig.py` first. It imports `masters`, `analysis`, `results` and what is below them.
"""
