"""From equations to FMU files."""
