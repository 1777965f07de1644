"""FMU files and the calls of the standard, below `instance.py` and `model_exchange.py`."""
