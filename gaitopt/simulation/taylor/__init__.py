"""The Taylor-series engine.

Expressions are brought into a form that heyoka integrates quickly, compiled once for each contact mode, and run with
their events.
"""
