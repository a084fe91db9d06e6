"""``python -m gaitopt`` runs the command line."""

from gaitopt.cli.app import main

main()
