"""Simulation of planar robots with any contacts: every contact is free, sticks or slips by itself."""
