"""Figures in files: every format, and a clear error when a file cannot be written."""

import tempfile

import pytest
from matplotlib.figure import Figure
from PIL import Image

from gaitopt import ArchiveError, InputError, plot_gait
from gaitopt.plot.saving import save_figure

STARTS = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.fixture
def figure():
    figure = Figure(figsize=(2, 1))
    figure.add_subplot()
    return figure


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg", ".PNG"])
def test_each_format_is_written(figure, tmp_path, suffix):
    path = save_figure(figure, tmp_path / f"gait{suffix}")
    assert path.read_bytes().startswith(STARTS[suffix.lower()])
    assert list(tmp_path.iterdir()) == [path]


def test_a_gait_is_saved_at_200_dots_per_inch(slipping, tmp_path):
    with Image.open(save_figure(plot_gait(slipping), str(tmp_path / "gait.png"))) as image:
        assert image.size == (1440, 1720)


@pytest.mark.parametrize("name", ["gait.bmp", "gait"])
def test_another_suffix_names_the_possible_ones(figure, tmp_path, name):
    with pytest.raises(InputError, match=r"\.png .*\.pdf .*\.svg"):
        save_figure(figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_named(figure, tmp_path):
    with pytest.raises(ArchiveError, match="does not exist"):
        save_figure(figure, tmp_path / "missing" / "gait.png")


def test_an_unwritable_folder_is_named(figure, tmp_path, monkeypatch):
    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "mkstemp", refuse)
    with pytest.raises(ArchiveError, match="not writable"):
        save_figure(figure, tmp_path / "gait.png")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_older_file(figure, tmp_path, monkeypatch):
    path = tmp_path / "gait.png"
    path.write_text("older")

    def fail(target, **kwargs):
        target.write_text("half")
        raise RuntimeError("disk on fire")

    monkeypatch.setattr(figure, "savefig", fail)
    with pytest.raises(RuntimeError, match="disk on fire"):
        save_figure(figure, path)
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]


def test_a_title_of_several_lines_gives_no_message(slip_gait, tmp_path, caplog):
    save_figure(plot_gait(slip_gait), tmp_path / "gait.png")
    assert caplog.messages == []
