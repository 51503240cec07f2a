"""The one place that makes an OpenGL context, and lends it to one thread at a time.

A context is current on one thread. `with device:` takes the device's lock and makes its context current, so that the
public functions may be called from any thread; nothing else may touch moderngl objects. Objects that Python lets go of,
on whatever thread, are released when the device is next entered.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from types import TracebackType
from typing import TYPE_CHECKING, Any

from ...errors import AutostereoError, DependencyError, UnsupportedError

if TYPE_CHECKING:
    from .programs import Programs

VERSIONS = (460, 450, 440, 430, 420, 410, 400, 330)  # asked for in turn; 330 so that a refusal can name what is there
COMPUTE_VERSION = 430  # compute shaders, storage buffers
GL_VERSION = 400  # double precision in shaders, which view maps need (lib/viewmap.glsl)
DEBIAN_PACKAGES = "libegl1 libgl1-mesa-dri libgl1"
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software rasterizer")
ADD = 0x8006  # GL_FUNC_ADD
CLIP_DISTANCES = range(0x3000, 0x3004)  # GL_CLIP_DISTANCE0 … 3, which cut tiles
LIGHT_NUMBERS, OTHER_UNIFORMS = 8, 400  # numbers of a light; of what else shaders are told, at most
GPU_NODES = ("/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/mali0", "/dev/kgsl-3d0")  # one is there if a GPU is


@dataclass(frozen=True)
class Limits:
    """What a device can hold, where it may be less than something needs.

    Attributes
    ----------
    texture, texture_3d : int
        Sides in pixels and voxels.
    buffer, storage : int
        Bytes of a buffer, and of one that shaders read as a whole.
    uniforms, vertex_outputs : int
        Numbers that a stage is told, and that a vertex hands on to its samples.
    draw_buffers, geometry_vertices, vertex_buffers : int
        Render targets, vertices that a geometry shader puts out, storage buffers of vertex shaders.
    """

    texture: int
    texture_3d: int
    buffer: int
    storage: int
    uniforms: int
    vertex_outputs: int
    draw_buffers: int
    geometry_vertices: int
    vertex_buffers: int

    @staticmethod
    def of(info: dict[str, Any], software: bool) -> Limits:
        """From what a context tells of itself; what it does not tell is what OpenGL 4 promises."""
        stages = ("VERTEX", "FRAGMENT", "COMPUTE")
        buffer = 2**31 - 1  # moderngl's sizes are ints
        return Limits(
            texture=min(info["GL_MAX_TEXTURE_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"]),
            texture_3d=info["GL_MAX_3D_TEXTURE_SIZE"],
            buffer=buffer,
            # llvmpipe tells 2²⁷, and reads all
            storage=buffer if software else min(buffer, info.get("GL_MAX_SHADER_STORAGE_BLOCK_SIZE", 2**24) or 2**24),
            uniforms=min(info.get(f"GL_MAX_{stage}_UNIFORM_COMPONENTS", 0) or 1024 for stage in stages),
            vertex_outputs=min(info.get("GL_MAX_VERTEX_OUTPUT_COMPONENTS", 64), 4 * info["GL_MAX_VARYING_VECTORS"]),
            draw_buffers=info["GL_MAX_DRAW_BUFFERS"],
            geometry_vertices=info["GL_MAX_GEOMETRY_OUTPUT_VERTICES"],
            vertex_buffers=info.get("GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS", 0),
        )


@dataclass(eq=False)
class Device:
    """An OpenGL context with its limits and programs; `with device:` makes it current on this thread.

    Attributes
    ----------
    ctx : moderngl.Context
    version : int
        430 is OpenGL 4.3.
    renderer : str
    uploaded : int
        Bytes of scene data sent to the device so far.
    reads : bool
        Whether pictures are read back; see `without_reading`.
    """

    ctx: Any
    version: int
    renderer: str
    limits: Limits
    uploaded: int = 0
    reads: bool = True
    _lock: Any = field(default_factory=threading.RLock)
    _entered: int = 0

    @property
    def is_hardware(self) -> bool:
        """Whether a GPU draws, and not the CPU in its stead."""
        return not is_software(self.renderer)

    @cached_property
    def programs(self) -> Programs:
        """Compiled shaders."""
        from .programs import Programs

        return Programs(self)

    @cached_property
    def filters_coarsely(self) -> bool:
        """Whether textures are interpolated with weights of a few bits, as GPUs do; the device has to be entered."""
        from .filtering import interpolates_coarsely

        return interpolates_coarsely(self)

    def __enter__(self) -> Device:
        self._lock.acquire()
        if self._entered == 0:
            try:
                self.ctx.__enter__()
                self._release_forgotten()
            except BaseException:
                self._lock.release()
                raise
        self._entered += 1
        return self

    def _release_forgotten(self) -> None:
        """Release what Python let go of; moderngl queues it (gc_mode), also what was released already."""
        queue = self.ctx.objects
        while queue:
            item = queue.popleft()
            if hasattr(item, "release"):
                item.release()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._entered -= 1
        try:
            if self._entered == 0:
                if error is not None:
                    self._restore()
                self.ctx.__exit__(kind, error, trace)
        finally:
            self._lock.release()

    def _restore(self) -> None:
        """What drawing relies on, if an error came amid a drawing that had set it otherwise."""
        self.ctx.blend_equation, self.ctx.depth_func = ADD, "<"
        for distance in CLIP_DISTANCES:
            self.ctx.disable_direct(distance)

    @contextmanager
    def without_reading(self) -> Iterator[None]:
        """Leave finished pictures on the device meanwhile, as for a screen: arrays to draw into stay as they are.

        Views with depths are read nevertheless: method dibr works on them.
        Frames in a row then overlap, and what is timed is drawing; `finish` waits for it.
        """
        before, self.reads = self.reads, False
        try:
            yield
        finally:
            self.reads = before

    def finish(self) -> None:
        """Wait until all is drawn."""
        with self:
            self.ctx.finish()

    def require(self, version: int, what: str, instead: str = "another method or engine='cpu'") -> None:
        """Raise UnsupportedError unless the context has this OpenGL version (430 is 4.3)."""
        if self.version < version:
            raise UnsupportedError(
                f"{what} needs OpenGL {_dotted(version)}, {self.renderer} has {_dotted(self.version)}: "
                f"update the graphics driver, or choose {instead}"
            )

    def check_texture(self, size: tuple[int, int], what: str) -> None:
        """Raise UnsupportedError when a picture of size (width, height) is larger than a texture can be."""
        if max(size) > self.limits.texture:
            raise UnsupportedError(
                f"{what} of {size[0]}×{size[1]} pixels is larger than a texture of this device, "
                f"{self.limits.texture} pixels a side ({self.renderer}): choose a smaller size or engine='cpu'"
            )

    def check_lights(self, count: int) -> None:
        """Raise UnsupportedError when shaders cannot be told of so many lights."""
        most = (self.limits.uniforms - OTHER_UNIFORMS) // LIGHT_NUMBERS
        if count > most:
            raise UnsupportedError(
                f"{count} lights are more than shaders of this device can be told of, {most} ({self.renderer}): "
                "choose fewer, or engine='cpu'"
            )

    def bind_storage(self, buffer: Any, binding: int) -> None:
        """Bind a buffer of an object for shaders to read, or raise UnsupportedError when they cannot read all of it."""
        size, most = buffer.size, self.limits.storage
        if size > most:
            raise UnsupportedError(
                f"an object takes {size / 1e6:.0f} MB, shaders of this device read {most / 1e6:.0f} MB "
                f"({self.renderer}): split it, or choose another method or engine='cpu'"
            )
        buffer.bind_to_storage_buffer(binding)

    def upload(self, data: Any) -> Any:
        """A buffer that holds an array of the scene; its bytes are counted."""
        raw = data.tobytes()
        if len(raw) > self.limits.buffer:
            raise UnsupportedError(
                f"a scene's array of {len(raw) / 1e6:.0f} MB is larger than a buffer of this device, "
                f"{self.limits.buffer / 1e6:.0f} MB ({self.renderer}): split the object or choose engine='cpu'"
            )
        self.uploaded += len(raw)
        return self.ctx.buffer(raw)


def _dotted(version: int) -> str:
    return f"{version // 100}.{version // 10 % 10}"


def is_software(renderer: str) -> bool:
    """Whether a renderer of this name is the CPU."""
    return any(name in renderer.lower() for name in SOFTWARE)


_lock = threading.Lock()
_made: Device | AutostereoError | None = None


def get_device() -> Device:
    """Return the process's device; made on the first call.

    It is never given back: releasing a context ends the EGL display of all others in the process, too.

    Raises
    ------
    DependencyError
        moderngl or a driver is not installed.
    UnsupportedError
        The driver's OpenGL is too old.
    """
    global _made
    with _lock:
        if _made is None:
            try:
                _made = _make()
            except AutostereoError as error:
                _made = error
    if isinstance(_made, AutostereoError):
        raise type(_made)(*_made.args)
    return _made


def hardware_answers() -> bool:
    """Whether a GPU can be drawn with, whatever is in the scene.

    Where the system shows none, no context is tried for: that takes a moment.
    """
    if sys.platform.startswith("linux") and not any(os.path.exists(node) for node in GPU_NODES):
        return False
    try:
        device = get_device()
        return device.is_hardware and device.version >= COMPUTE_VERSION
    except AutostereoError:
        return False


def _make() -> Device:
    try:
        import moderngl
    except ImportError:
        raise DependencyError("engine gl needs moderngl: pip install autostereo[gl]") from None
    ctx = _newest_context(moderngl)
    ctx.gc_mode = "context_gc"
    info, renderer = ctx.info, ctx.info["GL_RENDERER"]
    device = Device(ctx, ctx.version_code, renderer, Limits.of(info, is_software(renderer)))
    _release_current()
    device.require(GL_VERSION, "engine gl", "engine='cpu'")
    return device


def _newest_context(moderngl: Any) -> Any:
    """A context of the newest version to be had: some drivers (NVIDIA's) give the version asked for and no more."""
    linux = sys.platform.startswith("linux")
    settings: dict[str, Any] = {"backend": "egl"} if linux else {}
    for version in VERSIONS:
        try:
            return moderngl.create_context(standalone=True, require=version, **settings)
        except Exception as error:  # moderngl and its backends raise plain exceptions
            refusal = error
    remedy = f"install a graphics driver, or Mesa's (Debian, Ubuntu: apt-get install {DEBIAN_PACKAGES})"
    advice = remedy if linux else "install a graphics driver"
    raise DependencyError(f"engine gl gets no OpenGL context ({_first_line(refusal)}): {advice}") from refusal


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _release_current() -> None:
    """Let this thread go of its current context: contexts are made current, and only this thread could use it."""
    if sys.platform == "win32":
        ctypes.windll.opengl32.wglMakeCurrent(None, None)
    elif sys.platform == "darwin":
        ctypes.CDLL("/System/Library/Frameworks/OpenGL.framework/OpenGL").CGLSetCurrentContext(None)
    else:
        egl = ctypes.CDLL("libEGL.so.1")
        egl.eglGetCurrentDisplay.restype = ctypes.c_void_p
        egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
        egl.eglMakeCurrent(egl.eglGetCurrentDisplay(), None, None, None)
