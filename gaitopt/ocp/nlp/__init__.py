"""Nonlinear programs (NLPs) and their solvers.

An NLP is assembled from small blocks that are mapped over their instances; its solvers are independent of gaits.
"""
