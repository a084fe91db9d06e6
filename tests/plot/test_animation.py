"""Animations: what is in the files, and that they are written whole or not at all."""

import imageio_ffmpeg
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from gaitopt import ArchiveError, InputError, animate
from gaitopt.motion.animation_frames import SHORTEST_SLIP, AnimationFrames
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot import animation
from gaitopt.plot.insets import Header, name_legs
from gaitopt.plot.stage import draw_pictures

QUICK = {"steps": 2, "fps": 5, "slow": 1.0}


@pytest.fixture(scope="module")
def gif(slipping, tmp_path_factory):
    """Return a GIF, and what its observer received."""
    told = []
    path = tmp_path_factory.mktemp("gif") / "gait.gif"
    animate(slipping, path, **QUICK, observer=lambda done, total: told.append((done, total)))
    return path, told


def test_gif_has_every_frame_and_they_differ(gif, slipping):
    path, _ = gif
    expected = len(AnimationFrames(slipping.motion, steps=2, rate=5, slow=1.0))
    with Image.open(path) as image:
        frames = []
        for number in range(image.n_frames):
            image.seek(number)
            frames.append(np.asarray(image.convert("RGB")).tobytes())
        assert image.info["duration"] == 200
        assert image.info["loop"] == 0
        assert image.size == (960, 544)
    assert len(frames) == expected == round(5 * 2 * (SHORTEST_SLIP + slipping.motion.segments[1].duration))
    assert len(set(frames)) == expected


def test_observer_is_told_of_every_frame(gif):
    _, told = gif
    total = told[0][1]
    assert told == [(done, total) for done in range(1, total + 1)]


def test_nothing_is_left_beside_the_file(gif):
    path, _ = gif
    assert list(path.parent.iterdir()) == [path]


def test_gif_keeps_time_in_hundredths(sticking, tmp_path):
    with Image.open(animate(sticking, tmp_path / "gait.gif", steps=1, fps=30, slow=0.5)) as image:
        assert image.info["duration"] == 30
        assert image.n_frames * 0.03 == pytest.approx(0.5 * sticking.period, abs=0.03)


def test_mp4_can_be_decoded(slipping, tmp_path):
    path = animate(slipping, tmp_path / "gait.mp4", **QUICK)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == len(AnimationFrames(slipping.motion, steps=2, rate=5, slow=1.0))
    assert seconds == pytest.approx(frames / 5, abs=0.05)
    reader = imageio_ffmpeg.read_frames(str(path))
    facts = next(reader)
    reader.close()
    assert facts["pix_fmt"].startswith("yuv420p")
    assert facts["size"] == (960, 544)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["gait.avi", "gait"])
def test_another_suffix_names_the_possible_ones(slipping, tmp_path, name):
    with pytest.raises(InputError, match=r"\.gif .*\.mp4"):
        animate(slipping, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("setting", [{"steps": 0}, {"fps": 0}, {"slow": 0.0}, {"slow": float("nan")}])
def test_a_setting_that_cannot_be_is_named(slipping, tmp_path, setting):
    with pytest.raises(InputError, match=next(iter(setting))):
        animate(slipping, tmp_path / "gait.gif", **setting)


def test_a_gait_of_nan_is_refused(not_a_number, tmp_path):
    with pytest.raises(InputError, match="not finite"):
        animate(not_a_number, tmp_path / "gait.gif")


def test_a_missing_folder_is_named(slipping, tmp_path):
    with pytest.raises(ArchiveError, match="does not exist"):
        animate(slipping, tmp_path / "missing" / "gait.gif")


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_an_interrupted_film_leaves_nothing_behind(slipping, tmp_path, suffix):
    path = tmp_path / f"gait{suffix}"
    path.write_text("older")

    def interrupt(done, total):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate(slipping, path, **QUICK, observer=interrupt)
    assert path.read_text() == "older"
    assert list(tmp_path.iterdir()) == [path]


def test_what_ffmpeg_complains_of_is_passed_on(slipping, tmp_path, monkeypatch):
    odd = (np.zeros((5, 5, 4), dtype=np.uint8) for _ in range(3))
    monkeypatch.setattr(animation, "draw_pictures", lambda gait, film, title: odd)
    with pytest.raises(ArchiveError, match="ffmpeg stopped"):
        animate(slipping, tmp_path / "gait.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["slipping_both_ways", "sloping", "infeasible"])
def test_other_gaits_are_drawn(name, request):
    gait = request.getfixturevalue(name)
    film = AnimationFrames(gait.motion, steps=9, rate=0.5, slow=2.0)
    pictures = [picture.copy() for picture in draw_pictures(gait, film)]
    assert len(pictures) == len(film)
    assert all(np.ptp(picture[:, :, :3]) > 0 for picture in pictures)


def test_an_animation_names_the_robot_and_the_legs(slipping, hop_gait, monkeypatch, tmp_path):
    for gait, legs in ((slipping, ["one leg", "the other leg"]), (hop_gait, ["foot"])):
        figure = Figure()
        name_legs(figure, view_motion(gait.motion))
        assert [text.get_text() for text in figure.legends[0].get_texts()] == legs
        figure = Figure()
        Header(figure, gait, AnimationFrames(gait.motion, steps=1, rate=5, slow=1.0), title="a robot")
        assert any(text.get_text().startswith("a robot, ") for text in figure.texts)
    titles = []
    monkeypatch.setattr(animation, "draw_pictures", lambda *_, title: titles.append(title) or iter([]))
    monkeypatch.setattr(animation, "_write_gif", lambda *_: None)
    for states in ({}, {"title": "walk"}):
        animate(slipping, tmp_path / "gait.gif", **states)
    assert titles == ["compass biped", "walk"]
