"""Nonlinear programs and their solvers.

A program is assembled from small blocks that are mapped over their instances; its solvers know nothing of gaits.
"""
