"""Export of models as FMU files, and the check of any FMU."""
