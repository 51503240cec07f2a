"""Pictures: textures, quilts, panels."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FileError
from .files import PathLike, read_bytes

MAX_PIXELS = 2**29  # twice the largest quilt, 16384²: 1.6 GB as RGB
TIFF, TIFF_BITS = (b"II*\0", b"MM\0*"), "8 or 16 bits a colour (floats are not read)"
_PILLOW_LIMIT = threading.Lock()


def read_image(path: PathLike, asked_by: PathLike | None = None) -> NDArray[np.uint8]:
    """Read a picture as (H, W, 3) uint8, or (H, W, 4) where it has transparency; rows from the top.

    `asked_by` is the file that refers to it, if any; an error names both.

    Raises
    ------
    FileError
        The file is missing, truncated, no picture, or larger than MAX_PIXELS.
    """
    return decode_image(read_bytes(path, asked_by), f"{path}" if asked_by is None else f"{asked_by}: texture {path}")


def decode_image(data: bytes, name: str) -> NDArray[np.uint8]:
    """Decode the bytes of a picture file, as `read_image`; `name` is what an error calls it."""
    return decode(data, name, _as_rgb)


def decode(data: bytes, name: str, pixels: Callable[[Any, str], NDArray[Any]]) -> NDArray[Any]:
    """Open the bytes of a picture file, and return what `pixels` makes of the PIL image and `name`."""
    from PIL import Image

    with _without_pillow_limit():
        try:
            image = Image.open(io.BytesIO(data))
        except Exception as error:
            if data[:4] in TIFF:
                raise FileError(f"{name}: is damaged, or is no TIFF of {TIFF_BITS}") from error
            raise FileError(f"{name}: is not a picture that can be read (PNG, JPEG, WebP, TIFF, BMP, …)") from error
        width, height = image.size
        if width * height > MAX_PIXELS:
            raise FileError(f"{name}: a picture of {width}×{height} pixels is too large, the limit is {MAX_PIXELS}")
        try:
            return pixels(image, name)
        except FileError:
            raise
        except MemoryError:
            raise FileError(f"{name}: not enough memory for {width}×{height} pixels") from None
        except Exception as error:  # decoders raise OSError, SyntaxError, ValueError, struct.error, zlib.error …
            raise FileError(f"{name}: the picture is damaged or truncated ({error})") from error


@contextmanager
def _without_pillow_limit() -> Iterator[None]:
    """Lift Pillow's limit, which warns above 89 Mpx and refuses above 179: a 16384² quilt has 268."""
    from PIL import Image

    with _PILLOW_LIMIT:
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = limit


def _as_rgb(image: Any, name: str) -> NDArray[np.uint8]:
    """Pixels of a PIL image as (H, W, 3|4) uint8."""
    if image.mode.startswith("I;16"):
        grey = np.asarray(image).astype(np.uint16)
        return np.repeat(((grey.astype(np.uint32) + 128) // 257).astype(np.uint8)[..., None], 3, axis=2)
    if image.mode in ("I", "F"):
        found = "floats" if image.mode == "F" else "integers of 32 bits"
        raise FileError(f"{name}: holds {found}, which have no fixed range as colours; expected {TIFF_BITS}")
    see_through = image.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in image.info
    mode = "RGBA" if see_through else "RGB"
    width, height = image.size
    pixels = np.empty((height, width, len(mode)), dtype=np.uint8)
    for top in range(0, height, 1024):  # in strips: a second copy of a large quilt would cost a gigabyte
        strip = image.crop((0, top, width, min(top + 1024, height)))
        pixels[top : top + 1024] = np.asarray(strip if strip.mode == mode else strip.convert(mode))
    return pixels
