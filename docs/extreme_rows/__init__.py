"""Rows of the table of extremes, one file for each extreme; read `row.py` first, then `gains.py`.

Each file has `rows()`, which returns its rows without running anything.
"""
