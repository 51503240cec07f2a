"""Looping animations: order, timing, colours, sizes, and what is missing or wrong."""

from __future__ import annotations

import builtins
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from autostereo.encoders import video
from autostereo.encoders.video import save_animation, sweep
from autostereo.errors import DependencyError, FileError, InputError
from autostereo.frame import ViewStack


def ramps(views: int, height: int, width: int) -> ViewStack:
    """Smooth pictures that differ in brightness: view k is a ramp plus a multiple of k."""
    color = np.full((views, height, width, 4), 255, np.uint8)
    x = np.linspace(0, 60, width)[None, :] + np.linspace(0, 30, height)[:, None]
    for k in range(views):
        color[k, ..., 0] = x + 160 * k / views
        color[k, ..., 1] = 120 - x + 100 * k / views
        color[k, ..., 2] = 40 + 200 * k / views
    return ViewStack(color)


def frames_of(path) -> list[np.ndarray]:
    with Image.open(path) as image:
        frames = []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")).astype(int))
        return frames


def decoded(path) -> list[np.ndarray]:
    av = pytest.importorskip("av")
    with av.open(str(path)) as file:
        return [
            frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray().astype(int)
            for frame in file.decode(video=0)
        ]


def test_sweep_goes_there_and_back():
    assert sweep(1) == [0]
    assert sweep(2) == [0, 1]
    assert sweep(5) == [0, 1, 2, 3, 4, 3, 2, 1]
    for views in range(2, 20):
        order = np.array(sweep(views))
        assert set(order) == set(range(views))
        assert (np.abs(order - np.roll(order, 1)) == 1).all()  # also from the last frame to the first


@pytest.mark.parametrize(("suffix", "tolerance"), [("gif", 4.0), ("webp", 3.0), ("mp4", 4.0)])
@pytest.mark.parametrize("views", [1, 2, 5])
def test_every_frame_is_its_view(tmp_path, suffix, tolerance, views):
    stack = ramps(views, 40, 64)
    path = save_animation(tmp_path / f"a.{suffix}", stack)
    frames = decoded(path) if suffix == "mp4" else frames_of(path)
    assert len(frames) == len(sweep(views))
    for k, frame in zip(sweep(views), frames, strict=True):
        assert np.abs(frame - stack.color[k, ..., :3]).mean() < tolerance
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_it_loops_for_ever_at_the_wanted_pace(tmp_path, suffix):
    with Image.open(save_animation(tmp_path / f"a.{suffix}", ramps(4, 20, 20), fps=12.5)) as image:
        assert image.info["loop"] == 0
        durations = []
        for k in range(image.n_frames):
            image.seek(k)
            image.load()
            durations.append(image.info["duration"])
    assert durations == [80] * 6


@pytest.mark.parametrize(("views", "swing"), [(2, 2 * 100), (31, 60 * 50), (100, 198 * 30)])
def test_a_swing_takes_three_seconds_within_10_to_30_frames_a_second(tmp_path, views, swing):
    with Image.open(save_animation(tmp_path / "a.gif", ramps(views, 4, 4))) as image:
        total = 0  # equal neighbours are merged into one longer frame
        for k in range(image.n_frames):
            image.seek(k)
            image.load()
            total += image.info["duration"]
    assert total == swing


def test_gif_colours_do_not_flicker(tmp_path):
    """All frames share one palette of 256 colours; palettes of their own would give hundreds more."""
    frames = frames_of(save_animation(tmp_path / "a.gif", ramps(6, 40, 64)))
    colours = np.unique(np.concatenate([frame.reshape(-1, 3) for frame in frames]), axis=0)
    assert len(colours) <= 256


def test_mp4_is_yuv420p_with_even_sizes(tmp_path):
    av = pytest.importorskip("av")
    stack = ramps(3, 41, 63)
    path = save_animation(tmp_path / "a.MP4", stack, fps=24)
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert (stream.width, stream.height, stream.pix_fmt) == (64, 42, "yuv420p")
        assert stream.codec_context.name == "h264"
        assert stream.average_rate == 24
    frame = decoded(path)[2]
    assert np.abs(frame[:41, :63] - stack.color[2, ..., :3]).mean() < 4
    assert np.abs(frame[41] - frame[40]).mean() < 3 and np.abs(frame[:, 63] - frame[:, 62]).mean() < 3


def test_mp4_above_4k_is_hevc(tmp_path):
    av = pytest.importorskip("av")
    with av.open(str(save_animation(tmp_path / "a.mp4", ramps(1, 64, 4098)))) as file:
        stream = file.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.codec_tag) == ("hevc", "hvc1")
        assert (stream.width, stream.height, stream.pix_fmt) == (4098, 64, "yuv420p")


@pytest.mark.parametrize("views", [1, 2])
def test_hevc_of_fewer_frames_than_x265_delays(tmp_path, views):
    """x265 left the decoding times of such loops unset: one file in three could not be written."""
    av = pytest.importorskip("av")
    stack = ramps(views, 16, 4098)
    for _ in range(20):
        with av.open(str(save_animation(tmp_path / "a.mp4", stack))) as file:
            packets = [packet.pts for packet in file.demux(video=0) if packet.size]
        assert len(packets) == views and packets == sorted(packets)


def test_mp4_without_pyav_says_what_to_install(tmp_path, monkeypatch):
    real = builtins.__import__

    def without_av(name, *args, **kwargs):
        if name == "av":
            raise ImportError("No module named 'av'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_av)
    with pytest.raises(DependencyError, match=r"pip install autostereo\[video\]"):
        save_animation(tmp_path / "a.mp4", ramps(2, 8, 8))
    assert list(tmp_path.iterdir()) == []


def test_bad_input_is_one_sentence(tmp_path):
    stack = ramps(2, 8, 8)
    with pytest.raises(InputError, match=r"expected an animation \(.gif .webp .mp4\), got '.avi'"):
        save_animation(tmp_path / "a.avi", stack)
    for fps in (0, -1, 1000, float("nan"), "3", True):
        with pytest.raises(InputError, match="fps"):
            save_animation(tmp_path / "a.gif", stack, fps)
    with pytest.raises(InputError, match=r"at most 16383 pixels a side, got 16400×1"):
        save_animation(tmp_path / "a.webp", ViewStack(np.zeros((1, 1, 16400, 4), np.uint8)))
    for suffix in ("gif", "webp", "mp4"):
        with pytest.raises(FileError, match="does not exist"):
            save_animation(tmp_path / "nowhere" / f"a.{suffix}", stack)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", ["gif", "webp", "mp4"])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_nothing_is_left_half_written(tmp_path, monkeypatch, suffix, error):
    target = tmp_path / f"a.{suffix}"
    target.write_bytes(b"old")

    def fail(*_args, **_options):
        raise error

    monkeypatch.setattr(Image.Image, "save", fail)
    monkeypatch.setattr(video, "_encode", fail)
    with pytest.raises(FileError if isinstance(error, OSError) else KeyboardInterrupt) as caught:
        save_animation(target, ramps(2, 8, 8))
    if isinstance(error, OSError):
        assert "No space left on device" in str(caught.value)
    assert target.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == [target.name]


def test_importing_the_encoders_is_light():
    """Neither Pillow nor PyAV nor Numba before something is written."""
    code = "import sys, autostereo.encoders; print([m for m in ('PIL', 'av', 'numba') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
