"""What linear maps tell before anything runs: stable steps, errors of steps, margins, orders, sample times.

Read `stability.py` first: the one-step matrix of an algorithm. It imports `masters`, `linear` and what is below them.
"""
