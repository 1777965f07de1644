"""What a user does with a scene: one file, one experiment.

Read `sweep.py` first. It imports `fidelity`, `assembly`, `measurement` and what is below them.
"""
