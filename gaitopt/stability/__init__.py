"""Stability of gaits: return maps, saltation, periodic gaits and their multipliers."""
