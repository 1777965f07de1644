"""FMU files and the calls of the standard, FMI 2 and 3, Co-Simulation and Model Exchange.

Read `description.py` and `co_simulation.py` first. It imports `systems` alone, and is all that knows fmpy. Instances of
foreign FMUs live in processes of their own: `isolation/`.
"""
