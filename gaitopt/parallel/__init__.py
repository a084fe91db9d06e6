"""Execution of tasks in several processes or on a cluster.

This wing knows no science: it runs a graph of tasks, survives the death of workers and can be interrupted.
"""
