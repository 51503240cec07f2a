"""The OpenGL device that tests draw with; where there is none they skip, saying why, and fail in CI."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

from autostereo.errors import AutostereoError

if TYPE_CHECKING:
    from autostereo.engines.gl.context import Device


def need_device() -> Device:
    """The process's device."""
    from autostereo.engines.gl.context import get_device

    try:
        return get_device()
    except AutostereoError as error:
        if os.environ.get("CI") == "true":
            raise
        pytest.skip(f"cannot be drawn: {error}")


def gl_error() -> str:
    """What OpenGL has to complain about since last asked; without a device, nothing."""
    context = sys.modules.get("autostereo.engines.gl.context")
    device = getattr(context, "_made", None)
    if device is None or isinstance(device, Exception):
        return "GL_NO_ERROR"
    with device:
        return str(device.ctx.error)
