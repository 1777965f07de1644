"""Analysis of linearised systems before a run: stable steps, errors of steps, margins, orders, sample times.

Read `stability.py` first: the one-step matrix of an algorithm. It imports `masters`, `linear` and what is below them.
"""
