"""_mechanics."""
