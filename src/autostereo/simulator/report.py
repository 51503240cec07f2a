"""What a simulation counted, and the pictures it made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..frame import decibels, squared_error

COUNTERS = {  # name: what people read
    "texels": "texels read by shaders",
    "texture_misses": "texture cache misses",
    "lookups": "filtered texture look-ups",
    "texture_bytes": "bytes read of textures",
    "depth_read": "bytes read of depth",
    "depth_written": "bytes written of depth",
    "depth_hits": "depth cache hits",
    "depth_misses": "depth cache misses",
    "depth_raw": "bytes of depth blocks written back, before compression",
    "color_read": "bytes read of colour",
    "color_written": "bytes written of colour",
    "color_hits": "colour cache hits",
    "color_misses": "colour cache misses",
    "color_raw": "bytes of colour blocks written back, before compression",
    "tiles": "tiles visited",
    "tiles_culled": "tiles culled by Z-max",
    "rows": "rows of tiles",
    "horizon_rows": "rows of tiles that cross the horizon of their triangle's plane",
}


@dataclass(frozen=True, eq=False)
class Report:
    """One simulated frame.

    Attributes
    ----------
    machine, scene : str
    views : int
    size : (width, height)
    counters : dict of int
        By the names of `COUNTERS`.
    covered, passed, shaded, approximated : ndarray of shape (V,), int64
        Per view: fragments inside triangles, those that passed the depth test, shader runs, fragments put together
        from others.
    color : ndarray of shape (V, H, W, 4), uint8
        RGB over the background, opacity.
    depth : ndarray of shape (V, H, W), float32
        Eye depth, inf where nothing is.
    how : ndarray of shape (V, H, W), uint8
        On request: 0 background, 1 shaded, 2 approximated; else of shape (0, 0, 0).
    misses : ndarray of shape (V, H, W), int32
        On request: texture cache misses of each pixel.
    """

    machine: str
    scene: str
    views: int
    size: tuple[int, int]
    counters: dict[str, int]
    covered: NDArray[np.int64]
    passed: NDArray[np.int64]
    shaded: NDArray[np.int64]
    approximated: NDArray[np.int64]
    color: NDArray[np.uint8]
    depth: NDArray[np.float32]
    how: NDArray[np.uint8]
    misses: NDArray[np.int32]

    @property
    def texture_bytes(self) -> int:
        """Bytes read of textures."""
        return self.counters["texture_bytes"]

    @property
    def depth_bytes(self) -> int:
        """Bytes read and written of depth."""
        return self.counters["depth_read"] + self.counters["depth_written"]

    @property
    def color_bytes(self) -> int:
        """Bytes read and written of colour."""
        return self.counters["color_read"] + self.counters["color_written"]

    @property
    def total_bytes(self) -> int:
        """All bytes that passed between the machine and its memory."""
        return self.texture_bytes + self.depth_bytes + self.color_bytes

    @property
    def miss_rate(self) -> float:
        """Bytes read of textures for each byte that shaders asked for: m of equation (3).

        With lines of one texel that is the share of misses.
        """
        return self.texture_bytes / max(1, 4 * self.counters["texels"])

    @property
    def share_approximated(self) -> NDArray[np.float64]:
        """Share of each view's fragments (V,) that needed no shader run."""
        return self.approximated / np.maximum(1, self.approximated + self.shaded)

    def psnr(self, exact: Report) -> NDArray[np.float64]:
        """Peak signal-to-noise ratio in dB of each view's RGB (V,) against another report's; inf where equal."""
        if self.color.shape != exact.color.shape:
            raise InputError(f"psnr: expected pictures of one shape, got {self.color.shape} and {exact.color.shape}")
        pairs = zip(self.color, exact.color, strict=True)
        return np.array([decibels(squared_error(mine[..., :3], other[..., :3])) for mine, other in pairs])

    def as_dict(self) -> dict[str, Any]:
        """All numbers, for JSON."""
        per_view = {k: getattr(self, k).tolist() for k in ("covered", "passed", "shaded", "approximated")}
        return {
            "machine": self.machine,
            "scene": self.scene,
            "views": self.views,
            "size": list(self.size),
            "bytes": {
                "texture": self.texture_bytes, "depth": self.depth_bytes, "color": self.color_bytes,
                "total": self.total_bytes,
            },
            "counters": self.counters,
            "per_view": per_view,
        }  # fmt: skip
