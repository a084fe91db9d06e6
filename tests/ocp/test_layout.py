import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.ocp.nlp.layout import Layout, Rows

SHAPES = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5)), min_size=1, max_size=6)


@given(SHAPES)
def test_tables_divide_the_vector_without_gap_or_overlap(shapes):
    layout = Layout()
    for i, (rows, places) in enumerate(shapes):
        layout.add(f"table {i}", [f"q{r}" for r in range(rows)], [f"node {p}" for p in range(places)])
    every = np.concatenate([table.ravel() for table in layout.tables.values()])
    assert sorted(every) == list(range(layout.size))


@given(SHAPES)
def test_every_index_is_labelled_with_its_own_row_and_place(shapes):
    layout = Layout()
    for i, (rows, places) in enumerate(shapes):
        layout.add(f"table {i}", [f"q{i}{r}" for r in range(rows)], [f"node {i}{p}" for p in range(places)])
    for i, (rows, places) in enumerate(shapes):
        table = layout[f"table {i}"]
        assert table.shape == (rows, places)
        for (r, p), index in np.ndenumerate(table):
            assert layout.label(index) == (f"node {i}{p}", f"q{i}{r}")


def test_entries_of_one_place_are_neighbours():
    layout = Layout()
    table = layout.add("angles", ["th1", "th2"], ["node 0", "node 1", "node 2"])
    assert table.tolist() == [[0, 2, 4], [1, 3, 5]]


def test_a_table_is_known_by_name():
    layout = Layout()
    layout.add("angles", ["th1"], ["node 0"])
    assert "angles" in layout
    assert "rates" not in layout


def test_bounds_of_rows_follow_the_layout():
    rows = Rows()
    rows.add("first", [("a", 0.0, 1.0), ("b", -2.0, 3.0)], ["node 0", "node 1"])
    index = rows.add("second", [("c", -np.inf, 0.0)], ["end"])
    lower, upper = rows.bounds()
    assert lower.tolist() == [0, -2, 0, -2, -np.inf]
    assert upper.tolist() == [1, 3, 1, 3, 0]
    assert index.tolist() == [[4]]
    assert rows.layout.label(3) == ("node 1", "b")


def test_no_rows_have_empty_bounds():
    assert Rows().bounds().shape == (2, 0)
