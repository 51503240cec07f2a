"""Looping animations of a view stack: the eye swings from the leftmost view to the rightmost and back."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..checks import check_number
from ..errors import DependencyError, FileError, InputError, UnsupportedError
from ..frame import ViewStack
from ..image import as_path, check_side, write_atomic
from ..memory import check_memory
from ..wording import counted

if TYPE_CHECKING:
    from PIL import Image

ANIMATION_SUFFIXES = (".gif", ".webp", ".mp4")
H264_PIXELS, H264_SIDE = 4096 * 2304, 4096  # level 5.2, the last that common decoders take
SWING_SECONDS = 3.0  # there and back, as far as 10…30 frames a second allow


def sweep(views: int) -> list[int]:
    """Order of the frames of one loop, 0 … V−1 … 1: repeated, each view's neighbours stay its neighbours."""
    return [*range(views), *range(views - 2, 0, -1)]


def save_animation(path: str | os.PathLike[str], views: ViewStack, fps: float | None = None) -> Path:
    """Write a looping animation; the suffix chooses GIF, WebP or MP4.

    GIF has one palette of 256 colours for all frames, so that colours do not flicker. MP4 is yuv420p with even sizes
    (a last odd row or column is repeated), H.264, or H.265 above 4K; it holds one loop, which the player repeats.

    Parameters
    ----------
    path : path
    views : ViewStack
    fps : float, optional
        Frames a second, 0.1…100; None: a swing of three seconds, within 10…30. GIF times are multiples of 10 ms.

    Raises
    ------
    InputError
        Unknown suffix, a wrong `fps`, or pictures larger than the format allows.
    FileError
        The file cannot be written; nothing is left behind.
    MemoryLimitError
        There is no room for what its writer holds.
    DependencyError
        MP4 needs PyAV, `pip install autostereo[video]`.
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix not in ANIMATION_SUFFIXES:
        raise InputError(f"{path}: expected an animation ({' '.join(ANIMATION_SUFFIXES)}), got {path.suffix!r}")
    order = sweep(views.views)
    if fps is None:
        fps = min(max(len(order) / SWING_SECONDS, 10.0), 30.0)
    fps = check_number("fps", fps, 0.1, 100)
    check_side(path, views.width, views.height)
    copies = 0 if suffix != ".webp" or views.color[0].flags.c_contiguous else views.color.nbytes
    check_room(path, views.views, (views.width, views.height), copies)
    if suffix == ".mp4":
        return _save_mp4(path, views, fps)
    frames = _gif_frames(views) if suffix == ".gif" else _frames(views)
    first = next(frames)
    options: dict[str, Any] = {"duration": round(1000 / fps), "loop": 0, "save_all": True, "append_images": frames}
    if suffix == ".gif":
        options |= {"duration": 10 * max(1, round(100 / fps)), "optimize": False, "disposal": 1}
    else:
        options |= {"quality": 90, "method": 2}
    return write_atomic(path, lambda file: first.save(file, format=suffix[1:], **options))


def check_room(path: Path, views: int, size: tuple[int, int], beside: int = 0) -> None:
    """Raise MemoryLimitError unless there is room for an animation and `beside` bytes more, such as its views."""
    need = beside + animation_memory(path.suffix.lower(), views, *size)
    check_memory(need, f"{path}: an animation of {counted(views, 'view')} of {size[0]}×{size[1]} pixels")


def animation_memory(suffix: str, views: int, width: int, height: int) -> int:
    """Bytes that writing an animation takes beside its views, as measured of pictures of scenes.

    GIF's writer holds a byte a pixel of all frames of the loop, half a byte more where every pixel changes, of mere
    noise four; WebP's their files, some hundredths to half a byte, of mere noise five. Encoders of MP4 hold the frames
    that they look ahead, and one for each thread.
    """
    loop = len(sweep(views))
    held = loop + loop // 2 + 20
    if suffix == ".mp4" and _is_large(width, height):
        held = 10 * min(loop, 30) + 25
    elif suffix == ".mp4":
        held = 6 * min(loop, 40 + 3 * (os.cpu_count() or 1) // 2) + 25
    return held * width * height


def _frames(views: ViewStack) -> Iterator[Image.Image]:
    """Frames of one loop in the memory that the stack has: WebP's writer holds them all."""
    images = [_image(views, k) for k in range(views.views)]
    yield from (images[k] for k in sweep(views.views))


def _image(views: ViewStack, k: int) -> Image.Image:
    """View k without its opacity."""
    from PIL import Image

    size = (views.width, views.height)
    return Image.frombuffer("RGBX", size, np.ascontiguousarray(views.color[k]), "raw", "RGBX", 0, 1)


def _gif_frames(views: ViewStack) -> Iterator[Image.Image]:
    """Frames of one loop in one palette, chosen from up to 16 of the views, thinned; GIF's writer holds copies."""
    from PIL import Image

    chosen = np.unique(np.linspace(0, views.views - 1, 16).astype(int))
    step = max(1, math.isqrt(views.height * views.width // 2**16))
    sample = np.concatenate(list(views.color[chosen, ::step, ::step, :3]))
    palette = Image.fromarray(sample).quantize(256, method=Image.Quantize.MEDIANCUT)
    for k in sweep(views.views):
        yield _image(views, k).convert("RGB").quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)


def _save_mp4(path: Path, views: ViewStack, fps: float) -> Path:
    try:
        import av
    except ImportError as error:
        raise DependencyError(f"{path}: mp4 needs PyAV; pip install autostereo[video]") from error

    try:
        return write_atomic(path, lambda file: _encode(file, views, fps))
    except av.error.FFmpegError as error:
        raise FileError(f"{path}: cannot be written as mp4 ({error.strerror or error})") from error


def _is_large(width: int, height: int) -> bool:
    """Whether H.264 cannot hold pictures of that size."""
    return height * width > H264_PIXELS or max(height, width) > H264_SIDE


def _even_frames(views: ViewStack) -> Iterator[NDArray[np.uint8]]:
    """Frames (H, W, 3) of one loop, with the last row and column repeated where H or W is odd."""
    padding = ((0, views.height % 2), (0, views.width % 2), (0, 0))
    for k in sweep(views.views):
        yield np.ascontiguousarray(np.pad(views.color[k, ..., :3], padding, mode="edge"))


def _encode(file: BinaryIO, views: ViewStack, fps: float) -> None:
    """Write one loop of the views as MP4, BT.709."""
    import av

    height, width = views.height + views.height % 2, views.width + views.width % 2
    large = _is_large(width, height)
    codec = "libx265" if large else "libx264"
    if codec not in av.codecs_available:
        raise UnsupportedError(f"mp4: this PyAV lacks {codec}; its wheels from PyPI have it")
    with av.open(file, mode="w", format="mp4") as container:
        stream: Any = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "18"}
        if large:
            # x265 sets no decoding times before its third frame, so shorter loops do without B frames, which need them
            stream.options["x265-params"] = "log-level=error" + (":bframes=0" if views.views < 3 else "")
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = 1  # BT.709
        context.color_range = 1  # 16…235, as yuv420p is understood
        if large:
            context.codec_tag = "hvc1"  # Apple's players know no other
        for pixels in _even_frames(views):
            frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
            container.mux(stream.encode(frame.reformat(format="yuv420p", dst_colorspace="ITU709")))
        container.mux(stream.encode())
