import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import Mode
from gaitopt.ocp.nlp.keys import STEP, Group, Key, Kind, Place, Row, StepPart, Unknown, table_name
from gaitopt.ocp.nlp.layout import Layout, Rows


def keys(names):
    return [Key(Kind.CUSTOM, name) for name in names]


def nodes(phase, count):
    return [Place(StepPart.PHASE, phase, Mode.STICK, node) for node in range(count)]


SHAPES = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5)), min_size=1, max_size=6)


@given(SHAPES)
def test_tables_divide_the_vector_without_gap_or_overlap(shapes):
    layout = Layout()
    for i, (rows, places) in enumerate(shapes):
        layout.add((Unknown.SLIDE, i), keys(f"q{r}" for r in range(rows)), nodes(i, places))
    every = np.concatenate([table.ravel() for table in layout.tables.values()])
    assert sorted(every) == list(range(layout.size))


@given(SHAPES)
def test_every_index_is_labelled_with_its_own_row_and_place(shapes):
    layout = Layout()
    for i, (rows, places) in enumerate(shapes):
        layout.add((Unknown.SLIDE, i), keys(f"q{i}{r}" for r in range(rows)), nodes(i, places))
    for i, (rows, places) in enumerate(shapes):
        table = layout[Unknown.SLIDE, i]
        assert table.shape == (rows, places)
        for (r, p), index in np.ndenumerate(table):
            assert layout.label(index) == (f"phase {i + 1} (stick), node {p}", f"q{i}{r}")


def test_entries_of_one_place_are_neighbours():
    layout = Layout()
    table = layout.add(Unknown.ANGLES, keys(["th1", "th2"]), nodes(0, 3))
    assert table.tolist() == [[0, 2, 4], [1, 3, 5]]


def test_a_table_is_known_by_its_key():
    layout = Layout()
    layout.add(Unknown.ANGLES, keys(["th1"]), [STEP])
    assert Unknown.ANGLES in layout
    assert Unknown.RATES not in layout


def test_bounds_of_rows_follow_the_layout():
    rows = Rows()
    rows.add(
        Group.TOUCHDOWN, [Row(Key(Kind.CUSTOM, "a"), 0.0, 1.0), Row(Key(Kind.CUSTOM, "b"), -2.0, 3.0)], nodes(0, 2)
    )
    index = rows.add(Group.INTEGRAL, [Row(Key(Kind.CUSTOM, "c"), -np.inf, 0.0)], [STEP])
    lower, upper = rows.bounds()
    assert lower.tolist() == [0, -2, 0, -2, -np.inf]
    assert upper.tolist() == [1, 3, 1, 3, 0]
    assert index.tolist() == [[4]]
    assert rows.layout.label(3) == ("phase 1 (stick), node 1", "b")


def test_no_rows_have_empty_bounds():
    assert Rows().bounds().shape == (2, 0)


def test_rows_are_found_by_kind_and_payload_at_nodes_and_inner_points():
    layout = Layout()
    rates = [Key(Kind.TORQUE_RATE, "hip"), Key(Kind.TORQUE_RATE, "ankle"), Key(Kind.NORMAL_FORCE)]
    layout.add((Group.INTERVAL, 0), [*rates, Key(Kind.NORMAL_FORCE, inner=1)], nodes(0, 2))
    layout.add((Group.END, 0), [Key(Kind.NORMAL_FORCE)], nodes(0, 1))
    assert sorted(layout.find(Kind.TORQUE_RATE)) == [0, 1, 4, 5]
    assert layout.find(Kind.TORQUE_RATE, "ankle").tolist() == [1, 5]
    assert sorted(layout.find(Kind.NORMAL_FORCE)) == [2, 3, 6, 7, 8]
    assert layout.find(Kind.SPEED).shape == (0,)


def test_keys_that_are_spelled_alike_differ():
    assert Key(Kind.CONTACT_NORMAL).label == Key(Kind.NORMAL_FORCE).label
    assert Key(Kind.CONTACT_NORMAL) != Key(Kind.NORMAL_FORCE)
    assert len({table_name(table) for table in Unknown}) == len(Unknown)
    assert table_name((Unknown.INNER_POWER, 1)) == "inner power 1"
