"""A picture and its depth in one frame: 2D+depth displays (displays.md 3.6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..checks import check_choice
from ..errors import InputError
from .stereo import halve

Pixels = NDArray[np.uint8]

SIDES = ("right", "left", "top", "bottom")
HEADER_BYTES = 10
CRC_POLYNOMIAL = 0x04C11DB7


def disparity_map(
    depth: NDArray[np.float32], focal: float, scale: float, comfort: float = 5.0, invert: bool = False
) -> Pixels:
    """Turn eye depth into a disparity map: white near, 128 on the focal plane.

    A rig without a far plane has no depth in 0…1. The map is therefore 127.5·(1 − p/comfort), clipped to 0…255, where
    p = scale·(1/focal − 1/d) is the parallax in pixels between adjacent views (DESIGN section 1): > 0 behind the focal
    plane, ±comfort at the ends of the map.

    Parameters
    ----------
    depth : ndarray of shape (H, W), float
        Eye depth d > 0; inf where nothing was hit, which is shown as infinitely far.
    focal : float
        Focal distance fd, in the unit of depth.
    scale : float
        f_x (pixels) times the offset between adjacent cameras (unit of depth).
    comfort : float
        Parallax in pixels at which the map ends.
    invert : bool
        Black near instead.

    Returns
    -------
    ndarray of shape (H, W), uint8

    Raises
    ------
    InputError
        An argument has the wrong form.
    """
    depth = np.asarray(depth)
    if depth.ndim != 2 or not np.issubdtype(depth.dtype, np.floating) or 0 in depth.shape:
        raise InputError(f"depth: expected (H, W) floats, got {depth.shape} {depth.dtype}")
    if not (depth > 0).all():
        raise InputError("depth: expected numbers > 0 (inf where nothing was hit), found zero, negative ones or NaN")
    for name, value in (("focal", focal), ("comfort", comfort)):
        if not 0 < value < np.inf:
            raise InputError(f"{name}: expected a number > 0, got {value!r}")
    if not 0 <= scale < np.inf:
        raise InputError(f"scale: expected a number ≥ 0, got {scale!r}")
    shown = np.empty(depth.shape, np.uint8)
    with np.errstate(over="ignore"):  # 1/d of the smallest numbers; clipped below
        for row, shades in zip(depth, shown, strict=True):  # a row at a time: float64 takes eight times the memory
            parallax = scale / comfort * (1 / focal - 1 / row.astype(np.float64))
            shades[:] = 127.5 * (1 + np.clip(parallax if invert else -parallax, -1, 1)) + 0.5
    return shown


def rgbd(color: Pixels, disparity: Pixels, side: str = "right") -> Pixels:
    """Put a disparity map beside its picture, as grey.

    Parameters
    ----------
    color : ndarray of shape (H, W, 3 | 4), uint8
    disparity : ndarray of shape (H, W), uint8
    side : {"right", "left", "top", "bottom"}
        Where the map goes.

    Returns
    -------
    ndarray of shape (H, 2·W, 3) or (2·H, W, 3), uint8
    """
    color, disparity = np.asarray(color), np.asarray(disparity)
    if color.ndim != 3 or color.shape[2] not in (3, 4) or color.dtype != np.uint8:
        raise InputError(f"rgbd: expected a picture (H, W, 3 or 4) uint8, got {color.shape} {color.dtype}")
    if disparity.shape != color.shape[:2] or disparity.dtype != np.uint8:
        raise InputError(f"rgbd: expected a map {color.shape[:2]} uint8, got {disparity.shape} {disparity.dtype}")
    check_choice("rgbd side", side, SIDES)
    parts = [color[..., :3], np.repeat(disparity[..., None], 3, axis=2)]
    return np.concatenate(parts if side in ("right", "bottom") else parts[::-1], axis=1 if side in SIDES[:2] else 0)


def crc32(data: bytes) -> int:
    """CRC-32 of the WOWvx header: polynomial 04C11DB7, initial value 0, no reflection, no final xor."""
    crc = 0
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1) ^ (CRC_POLYNOMIAL if crc & 0x80000000 else 0)
            crc &= 0xFFFFFFFF
    return crc


def wowvx_header(content: int = 2, factor: int = 64, offset: int = 128) -> bytes:
    """Return the ten bytes of a WOWvx header: F1, content, factor, offset, 00, 00, CRC-32 (big-endian).

    Parameters
    ----------
    content : int
        Kind of content, 0…255.
    factor, offset : int
        How the display scales the map and where its screen plane lies, 0…255.
    """
    for name, value in (("content", content), ("factor", factor), ("offset", offset)):
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 255:
            raise InputError(f"wowvx {name}: expected a whole number from 0 to 255, got {value!r}")
    body = bytes([0xF1, content, factor, offset, 0, 0])
    return body + crc32(body).to_bytes(4, "big")


def write_header(frame: Pixels, header: bytes) -> None:
    """Write a header into the top row of frame (H, W, 3).

    Bit k of byte b is 0 or 255 in the blue of pixel 16·b + 2·(7 − k); all else stays.
    """
    bits = np.unpackbits(np.frombuffer(header, np.uint8))
    if frame.shape[1] < 2 * len(bits):
        raise InputError(f"wowvx: expected a frame at least {2 * len(bits)} pixels wide, got {frame.shape[1]}")
    frame[0, : 2 * len(bits) : 2, 2] = 255 * bits


def wowvx(color: Pixels, disparity: Pixels, header: bytes | None = None, *, anamorphic: bool = False) -> Pixels:
    """Make a 2D+depth frame for WOWvx displays: picture left, map right, each at half width, header in the top row.

    Their frames have 1920×1080 pixels. Of two pixels of the map the nearer (whiter) one stays: averages would be
    depths where there is nothing.

    Parameters
    ----------
    color : ndarray of shape (H, W, 3 | 4), uint8
    disparity : ndarray of shape (H, W), uint8
    header : bytes, optional
        Ten bytes; None: `wowvx_header()`.
    anamorphic : bool
        Picture and map already have half the width of the frame.

    Returns
    -------
    ndarray of shape (H, W, 3), uint8; (H, 2·W, 3) if anamorphic
    """
    header = wowvx_header() if header is None else header
    if len(header) != HEADER_BYTES:
        raise InputError(f"wowvx header: expected {HEADER_BYTES} bytes, got {len(header)}")
    frame = rgbd(color, disparity)
    if not anamorphic:
        width = frame.shape[1] // 2
        half = halve(frame[:, :width], 1)
        nearer = np.maximum(frame[:, width::2], frame[:, width + 1 :: 2])
        frame = np.concatenate([half, nearer], axis=1)
    write_header(frame, header)
    return frame
