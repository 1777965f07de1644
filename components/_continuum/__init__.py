"""The 3-RRR stage as an elastic body: outline, mesh, finite elements, and what follows from them.

Start with `piece.py`. The libraries of the extra `fem` are imported by the functions that mesh and assemble, in
`meshing.py` and `elements.py`; everything else, the cached results included, does without.
"""
