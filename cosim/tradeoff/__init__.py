"""Trade of speed for accuracy: the cheapest way to run a scene within an error, predicted and then verified.

A configuration is what may be chosen: levels, fused groups, algorithm and step. Read `configuration.py` first, then
`search.py`; `responses.py` and `motion.py` predict and measure the error of one, `costs.py` its cost.
"""
