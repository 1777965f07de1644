"""Co-simulation algorithms and their masters: one algorithm is one file, and `algorithms.py` is the table of all.

Read `master.py`, then `gauss_seidel.py`. It imports `linear`, `actions` and what is below them.
"""
