"""Basins of attraction: where walks from a grid of initial states end."""
