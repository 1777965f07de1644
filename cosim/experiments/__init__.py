"""Experiments on a scene, one file each: sweep, run, compare, open loop, stability, identify.

Read `sweep.py` first. It imports `fidelity`, `assembly`, `measurement` and what is below them.
"""
