"""Sweeps: optimal gaits over a grid of parameters and contact sequences, as one labelled dataset."""
