"""Robustness margins: pushes, slopes, friction patches, torque noise and sensor delay that a gait survives."""
