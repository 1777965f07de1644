"""The modelling framework: quantities, equations, composition, linearisation, design studies and the registry of parts.

Read `model.py`, then `parts.py` and `catalogue.py`. Parts take `Model` and `ModelError` from `hfsa.components`.
"""
