"""HDF5 files below `results.py`: groups, records of a signal, and what is left to do."""
