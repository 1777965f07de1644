"""The ways to run a system: one file, one algorithm; `algorithms.py` is their table.

Read `master.py`, then `gauss_seidel.py`. It imports `linear`, `actions` and what is below them.
"""
