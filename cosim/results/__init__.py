"""Results in HDF5: the records of a file, and how it is written, read and resumed.

Read `files.py` first, then `records.py`. It imports `systems` and `signals`.
"""
