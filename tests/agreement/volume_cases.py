"""Random volumes, cameras and panels on which engines are compared, and how alike pictures have to be."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, Phase, reject, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

import autostereo as aus
from autostereo.transforms import rotation, translation

W, H = SIZE = (40, 30)
TYPES = {"uint8": (0, 255), "uint16": (100, 60000), "int16": (-1000, 3000), "float32": (-0.3, 0.9)}
KINDS = ("noise", "blobs", "ramp", "constant", "spike")
MODES = ("composite", "mip", "iso")
LIGHTS = (aus.DirectionalLight((0.5, -1, -1), (0.8, 0.7, 0.6)), aus.PointLight((1.5, 0.5, 2.5), (0.3, 0.4, 0.5)))
BACKGROUND = (0.1, 0.2, 0.3)
LENSES = {"lens_pitch": 5.7, "subpixel_pitch": 1.0, "slant_deg": 9.46, "phase": 0.3}


def random(examples: int) -> settings:
    """So many random cases; a failing one is shown as it is found, for looking for a simpler one takes minutes."""
    quiet = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]
    phases = [Phase.explicit, Phase.reuse, Phase.generate]
    return settings(deadline=None, max_examples=examples, suppress_health_check=quiet, phases=phases)


def displays() -> dict[str, aus.Display]:
    """One of every kind of mask, by name."""
    slanted = aus.Display.slanted(W, H, 9, **LENSES)
    rng = np.random.default_rng(3)
    return {
        "lenticular": aus.Display.lenticular(W, H, 5),
        "wavelength-selective": aus.Display.wavelength_selective(W, H),
        "slanted": slanted,
        "mirrored": replace(slanted, flip_x=True, flip_y=True),
        "reversed": aus.Display.slanted(W, H, 9, **LENSES | {"slant_deg": -20.0}, reverse=True),
        "many views": aus.Display.slanted(W, H, 100, **LENSES),
        "continuous": aus.Display.slanted(W, H, 9, **LENSES, continuous=True),
        "continuous, mirrored": replace(
            aus.Display.slanted(W, H, 9, **LENSES, continuous=True, reverse=True), flip_x=True
        ),
        "table": aus.Display.from_table(W, H, 6, rng.integers(0, 6, (5, 7, 3))),
        "one view": aus.Display.lenticular(W, H, 1),
    }


DISPLAYS = displays()
DISCRETE = [name for name in DISPLAYS if "continuous" not in name]


def field(kind: str, shape: tuple[int, int, int], rng: np.random.Generator) -> NDArray[np.float64]:
    """Scalars 0…1 of a shape (nz, ny, nx)."""
    if kind == "constant":
        return np.full(shape, 0.6)
    if kind == "spike":
        result = np.zeros(shape)
        result[tuple(n // 2 for n in shape)] = 1
        return result
    if kind == "ramp":
        k, j, i = np.mgrid[tuple(slice(n) for n in shape)]
        a, b, c = rng.normal(size=3)
        result = a * i + b * j + c * k
    else:
        result = rng.random(shape)
        if kind == "blobs":
            result = ndimage.gaussian_filter(result, 1.5, mode="wrap")
    return (result - result.min()) / np.ptp(result)


def transfer(rng: np.random.Generator, values: tuple[float, float], steep: bool, tau: float) -> aus.TransferFunction:
    """A random function that shows something of a range of values, with a step or slopes."""
    low, high = values
    count = int(rng.integers(2, 6))
    at = (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count * 1.2 - 0.1
    if steep:
        at = np.sort(rng.uniform(-0.1, 1.1, count))
        at[1] = at[0]
    opacity = rng.random(len(at)) * rng.choice([0.0, tau], len(at))
    opacity[rng.integers(len(at))] = tau
    return aus.TransferFunction(np.column_stack([low + (high - low) * at, rng.random((len(at), 3)), opacity]))


def place(rng: np.random.Generator, shape: tuple[int, int, int], oblique: bool) -> dict[str, object]:
    """Spacing, direction and origin that put a volume (nz, ny, nx) of diagonal 2 around the origin."""
    spacing = rng.uniform(0.4, 1.5, 3)
    last = np.array(shape[::-1]) - 1
    spacing *= 2 / np.linalg.norm(last * spacing)
    direction = np.eye(3)
    if oblique:
        direction = rotation(rng.normal(size=3), float(rng.uniform(0, 360)))[:3, :3]
        if rng.random() < 0.3:  # a tilted gantry
            direction[:, 2] = 0.8 * direction[:, 2] + 0.6 * direction[:, 1]
    return {"spacing": tuple(spacing), "direction": direction, "origin": tuple(-(direction * spacing) @ last / 2)}


@st.composite
def volumes(
    draw: st.DrawFn, modes: tuple[str, ...] = MODES, shaded: bool | None = None, steep: bool | None = None
) -> aus.Volume:
    """Volumes of every kind about the origin, of 2…14 voxels along each axis."""
    kind, mode, dtype = (draw(st.sampled_from(choice)) for choice in (KINDS, modes, tuple(TYPES)))
    shape = tuple(draw(st.tuples(*[st.integers(2, 14)] * 3)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    low, high = TYPES[dtype]
    values = low + (high - low) * field(kind, shape, rng)
    fields: dict[str, object] = place(rng, shape, draw(st.booleans()))
    if draw(st.booleans()):
        stretch = np.diag([*rng.uniform(0.6, 1.4, 3), 1.0])
        turn = rotation(rng.normal(size=3), float(rng.uniform(0, 360)))
        fields["transform"] = translation(*rng.normal(0, 0.2, 3)) @ turn @ stretch
    if draw(st.booleans()):
        fields["clip_box"] = [rng.uniform(-1, -0.1, 3), rng.uniform(0.1, 1, 3)]
    if draw(st.booleans()):
        fields["clip_plane"] = (*rng.normal(size=3), rng.uniform(0, 0.3))
    if mode == "iso":
        fields["iso"] = low + (high - low) * rng.uniform(0.2, 0.8)
    material = aus.Material(0.2, 0.7, float(draw(st.sampled_from([0.0, 0.4]))), 20.0)
    shade = draw(st.booleans()) if shaded is None else shaded
    steep = draw(st.booleans()) if steep is None else steep
    tau = float(10 ** rng.uniform(-0.5, 1.3 if steep else 0.5))
    return aus.Volume(
        values.astype(dtype), transfer=transfer(rng, TYPES[dtype], steep, tau), mode=mode, shade=shade,
        gradient=draw(st.sampled_from(["central", "sobel"])), material=material, **fields,
    )  # fmt: skip


@st.composite
def rigs(draw: st.DrawFn, views: int | None = None, inside: bool = True) -> aus.Rig:
    """Cameras before the origin; some stand within what is around it, or have it partly behind them."""
    depths = [3.2, 3.2, 2.4] + ([1.1, 0.3] if inside else [])
    position = draw(st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.sampled_from(depths)))
    return aus.Rig(
        position=position, target=(0, 0, -2), fov_y=40, views=views or draw(st.sampled_from([1, 2, 5])),
        baseline=draw(st.floats(0, 1.5)), focal_distance=draw(st.floats(1.5, 5)),
        aspect=draw(st.sampled_from([None, 1.0])), offset_y=draw(st.sampled_from([0.0, 0.2])), near=0.05,
    )  # fmt: skip


@st.composite
def scenes(draw: st.DrawFn, **kind: object) -> aus.Scene:
    """A volume (see `volumes`) under the default light or others."""
    return aus.Scene(draw(volumes(**kind)), draw(st.sampled_from([None, LIGHTS])), BACKGROUND)


@contextmanager
def somewhere_in_front() -> Iterator[None]:
    """Leave out random scenes that lie wholly behind the cameras: they are refused."""
    try:
        yield
    except aus.InputError as error:
        if "behind the cameras" in str(error):
            reject()
        raise


def views(scene: object, rig: aus.Rig, engine: str, size: tuple[int, int] = SIZE, **options: object) -> aus.ViewStack:
    """A stack of views; method= as in `render_views`."""
    method, switches = str(options.pop("method", "single-pass")), aus.Options(**options)  # type: ignore[arg-type]
    with somewhere_in_front():
        return aus.render_views(scene, rig, size, engine=engine, method=method, options=switches)


def panel(
    scene: object, display: aus.Display, rig: aus.Rig, engine: str, **options: object
) -> NDArray[np.uint8]:
    """Pixels of a panel; method= as in `render`."""
    method, switches = str(options.pop("method", "single-pass")), aus.Options(**options)  # type: ignore[arg-type]
    with somewhere_in_front():
        return aus.render(scene, display, rig, engine=engine, method=method, options=switches).pixels


def psnr(found: NDArray[np.uint8], expected: NDArray[np.uint8]) -> float:
    """Peak signal to noise, dB."""
    error = float(((found.astype(np.float64) - expected) ** 2).mean())
    return 10 * np.log10(255**2 / max(error, 1e-9))


def assert_alike(
    found: NDArray[np.uint8], expected: NDArray[np.uint8], share: float = 0.02, where: NDArray[np.bool_] | None = None
) -> None:
    """Samples `where` (all) within one level, but for a share of all (2 % where nothing else is said)."""
    difference = np.abs(found.astype(int) - expected).max(axis=-1)
    beyond = (difference > 1) if where is None else (difference > 1) & where
    assert beyond.mean() <= share, f"{beyond.mean():.2%} of the samples differ, by up to {difference[beyond].max()}"


def smooth(stack: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Pixels (V, H, W) of views (V, H, W, C) whose neighbours are much like them: no outlines."""
    size = (1, 3, 3, 1)
    spread = ndimage.maximum_filter(stack, size).astype(int) - ndimage.minimum_filter(stack, size)
    return np.asarray(spread.max(axis=-1) <= 24)


def assert_one_pass_is_many(scene, display, rig, engine, **options):
    """One pass and n passes are equal bit for bit, with and without depths, as views and on a panel.

    On gl a panel may round otherwise than views: a different shader draws it. Of its sub-pixels 0.1 % may differ.
    """
    rig = rig.with_views(display.views)
    one = views(scene, rig, engine, depth=True, **options)
    many = views(scene, rig, engine, method="n-pass", depth=True, **options)
    np.testing.assert_array_equal(one.color, many.color)
    np.testing.assert_array_equal(one.depth, many.depth)
    np.testing.assert_array_equal(views(scene, rig, engine, **options).color, many.color)
    found = panel(scene, display, rig, engine, **options)
    woven = aus.interlace(many, display).pixels
    assert (found != woven).mean() <= (0.001 if engine == "gl" else 0)
    np.testing.assert_array_equal(woven, panel(scene, display, rig, engine, method="n-pass", **options))
