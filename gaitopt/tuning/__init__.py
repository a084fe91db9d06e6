"""Feedback designed and tuned for a gait."""
