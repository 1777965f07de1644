"""How much model, and which step, a scene needs: levels, errors of levels, what amplitudes and steps do.

Read `levels.py` first. It imports `assembly` and what is below it.
"""
