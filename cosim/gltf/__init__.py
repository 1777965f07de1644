"""Machines as 3D models for CAD viewers: glTF 2.0, with modes or a recorded motion as animations.

Begin with `model.py`, what a model is made of. `of_drawing.py` makes one of a part's drawing, `of_run.py` one of what
moved in a run, and `file.py` writes it.
"""
