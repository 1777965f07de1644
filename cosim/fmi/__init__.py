"""FMU files and the calls of the standard, below `fmi/co_simulation.py` and `fmi/model_exchange.py`."""
