"""HDF5 files below `results/files.py`: groups, records of a signal, and what is left to do."""
