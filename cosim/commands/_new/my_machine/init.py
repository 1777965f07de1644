"""The parts of this machine: one file, one part; files that begin with an underscore help them."""
