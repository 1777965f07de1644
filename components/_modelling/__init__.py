"""What models are made of: quantities, equations, levels, composition, derivatives, and how parts are found.

Read `model.py`, then `parts.py`. Parts take `Model` and `ModelError` from `hfsa.components`.
"""
