"""Transcription of a gait problem into a nonlinear program.

The grid, the integration schemes, and the constraints of phases, impacts and guards,
in smooth and in complementarity form.
"""
