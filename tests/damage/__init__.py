"""Damage to files: whether it is noticed, and ends neither in a crash nor in a hang."""
