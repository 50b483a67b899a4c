"""Films of recordings: they show what was recorded, and outlive their encoder."""

from pathlib import Path

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pytest

from console import existing
from console.recording.format import Recording, Take
from console.video import rendering
from console.video.drawing import Look
from tests.support.console.recordings import take
from world.errors import ConfigError


@pytest.mark.skipif(rendering.choose_gl() is None, reason="nothing draws offscreen here")
def test_a_video_shows_a_chair_and_a_character(tmp_path: Path) -> None:
    film, strip = tmp_path / "a.mp4", tmp_path / "a.png"
    look = Look(width=160, height=128)
    assert rendering.write_video(Recording([take(5)], {}), film, look) == 5
    assert imageio.imread(film, index=0).shape == (128, 160, 3)
    rendering.write_filmstrip(Recording([take(5)], {}), strip, 3)
    image = imageio.imread(strip)
    assert image.shape == (240, 840, 3)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20


@pytest.mark.skipif(rendering.choose_gl() is None, reason="nothing draws offscreen here")
def test_an_animated_picture_has_every_second_step_and_repeats(tmp_path: Path) -> None:
    from PIL import Image

    look, counted = Look(width=160, height=128), []
    for name, kind in (("a.webp", "WEBP"), ("a.gif", "GIF")):
        film = tmp_path / name
        count = rendering.write_video(
            Recording([moving(5)], {}), film, look, progress=counted.append
        )
        with Image.open(film) as found:
            assert (found.format, getattr(found, "n_frames", 1)) == (kind, count) == (kind, 3)
            assert found.size == (160, 128) and found.info["loop"] == 0
    assert counted == [2, 4, 6] * 2


@pytest.mark.skipif(rendering.choose_gl() is None, reason="nothing draws offscreen here")
def test_films_and_pictures_say_who_made_them_and_on_which_terms(tmp_path: Path) -> None:
    """So that a command replaces them, and no film or picture of a user."""
    from PIL import Image

    look, terms = Look(width=64, height=48), "CC0-1.0 \u00e4"
    for licence in ({}, {"licence": terms}):
        found = Recording([moving(5)], licence)
        for suffix in (".mp4", ".webp", ".gif", ".png"):
            path = tmp_path / f"a{suffix}"
            if suffix == ".png":
                rendering.write_filmstrip(found, path, 2)
            else:
                rendering.write_video(found, path, look)
            existing.require(path, "", existing.OF_SUFFIX[suffix])
            assert (terms.encode() in path.read_bytes()) == bool(licence), suffix
            if suffix != ".mp4":
                Image.new("RGB", (64, 48)).save(path)
            else:
                imageio.imwrite(path, np.zeros((3, 48, 64, 3), np.uint8), fps=30)
            with pytest.raises(ConfigError, match=r"exists and is an? .*, not an? .* of inhabit"):
                existing.require(path, "", existing.OF_SUFFIX[suffix])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.gif", "a.mp4", "a.png", "a.webp"]


def test_a_damaged_picture_or_film_is_none_of_inhabit(tmp_path: Path) -> None:
    for name, content in (
        ("a.png", b"\x89PNG" + 40 * b"x"),
        ("a.gif", b"GIF89a" + 40 * b"x"),
        ("a.webp", b"RIFF\0\0\0\0WEBP" + 40 * b"x"),
        ("a.mp4", b"\0\0\0\x14ftyp" + 12 * b"x" + b"\0\0\0\x03moov"),
        ("b.mp4", b"\0\0\0\x14ftyp" + 12 * b"x" + b"\0\0\xff\xffmoov\xa9cmt"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ConfigError, match=r"exists and is an? .*, not an? .* of inhabit"):
            existing.require(tmp_path / name, "", existing.OF_SUFFIX[name[1:]])


def moving(steps: int) -> Take:
    one = take(steps)
    one.qpos[:, 0] = np.linspace(0.0, 0.2, steps)
    return one


@pytest.mark.parametrize("broken", [1, 2])
def test_an_encoder_that_is_gone_is_started_once_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: int
) -> None:
    encode, begun = imageio_ffmpeg.write_frames, []

    def write_frames(*args, **kwargs):
        begun.append(args)
        if len(begun) <= broken:
            yield
            raise OSError("[Errno 32] Broken pipe")
        yield from encode(*args, **kwargs)

    monkeypatch.setattr(imageio_ffmpeg, "write_frames", write_frames)
    out, look = tmp_path / "a.mp4", Look(width=160, height=128)
    if broken == 1:
        assert rendering.write_video(Recording([take(5)], {}), out, look) == 5
        assert len(list(imageio.imiter(out))) == 5
    else:
        with pytest.raises(rendering.VideoError, match=r"cannot write .*Broken pipe"):
            rendering.write_video(Recording([take(5)], {}), out, look)
        assert not list(tmp_path.iterdir())
    assert len(begun) == 2


def test_a_process_more_is_started_for_every_hundred_images_up_to_the_threads() -> None:
    assert [rendering.processes_for(count, 4) for count in (0, 199, 200, 399, 10_000)] == [
        1, 1, 2, 3, 4,
    ]  # fmt: skip
    assert rendering.processes_for(10_000, 1) == 1 and rendering.processes_for(10_000, 64) == 8
