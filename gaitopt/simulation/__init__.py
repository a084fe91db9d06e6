"""Event-driven stick-slip simulation and the verification of gaits by replay."""
