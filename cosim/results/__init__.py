"""Results in HDF5: what is in a file, how it is written, found again and gone on with.

Read `files.py` first, then `records.py`. It imports `systems` and `signals`.
"""
