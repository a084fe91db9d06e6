"""Numbers the tests compare gaitopt with, each computed by a script of this folder that does not use gaitopt.

``python -m tests.references.NAME`` computes and prints the numbers of a script, ``--write`` writes them to
references.json.  Equations of motion are those of tests/newton_euler or stand in the script.
"""
