"""Optimal control: from a gait problem to a solved gait."""
