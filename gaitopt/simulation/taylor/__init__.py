"""The Taylor-series engine.

Expressions are transformed into a form that heyoka integrates quickly, compiled once for each contact mode, and
integrated with event detection.
"""
