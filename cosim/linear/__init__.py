"""Linear maps of FMUs and of the actions of a cycle."""
