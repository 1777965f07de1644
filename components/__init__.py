"""What things are: one file, one part; equations become a `Model`."""
