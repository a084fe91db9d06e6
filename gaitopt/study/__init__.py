"""Studies: basins, figures and numbers over many gaits."""
