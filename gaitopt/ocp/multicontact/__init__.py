"""Optimal gaits of planar robots with any contacts: every phase in the same coordinates, every event a set of rows."""
