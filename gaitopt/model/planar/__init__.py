"""Planar robots with any number of contacts: point and round feet, joint stops, flight."""
