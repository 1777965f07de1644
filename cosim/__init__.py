"""From FMUs to measurements: wiring, co-simulation, sweeps, results."""
