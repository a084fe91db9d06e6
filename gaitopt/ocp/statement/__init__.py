"""Parts of the statement of a gait problem.

These are the objective, limits and margins, initial guesses and warm starts.
"""
