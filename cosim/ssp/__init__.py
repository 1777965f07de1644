"""System structure packages (SSP) of the Modelica Association: scenes out, systems of other tools in.

Read `write.py` for the way out and `read.py` for the way in. It sees FMU files and systems, never parts.
"""
