"""Motion as plain data: contact sequences, segments and jumps, gaits, energy, files."""
