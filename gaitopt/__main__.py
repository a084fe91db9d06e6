"""``python -m gaitopt`` and ``gaitopt`` run the command line."""

from gaitopt.cli.collection import collect_rarely


def main() -> None:
    """Import the commands and run the one that the command line names."""
    with collect_rarely():
        from gaitopt.cli import app

        app.main()


if __name__ == "__main__":
    main()
