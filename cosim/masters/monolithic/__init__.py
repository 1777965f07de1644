"""The FMUs of a system as one equation, and its solution by CVODE or IDA: below `masters/monolithic/master.py`."""
