"""Periodic gaits of planar robots with any contacts, modulo leg exchange and travel, and their multipliers."""
