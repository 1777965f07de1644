"""_modelling."""
