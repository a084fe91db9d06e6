"""Scripts of other tools are run by the benchmarks, where those tools are installed; they hold no tests."""

collect_ignore_glob = ["plain_*.py", "bare_*.py"]
