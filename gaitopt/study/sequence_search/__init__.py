"""Search over contact sequences: every sequence is solved, replayed and ranked."""
