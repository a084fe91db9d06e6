"""Transcription of a gait problem into a nonlinear program.

It contains the grid, the integration schemes, and the constraints of phases, impacts and guards, in smooth and in
complementarity form.
"""
