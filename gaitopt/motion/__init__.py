"""Motion as plain data: words, segments and jumps, gaits, energy, files."""
