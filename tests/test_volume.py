"""Volumes: construction, geometry, statistics."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import autostereo as aus
from autostereo.transforms import apply, rotation, translation

RAMP = np.arange(4 * 5 * 6, dtype=np.float32).reshape(4, 5, 6)  # nz, ny, nx
GREY = aus.TransferFunction([(0, 0, 0, 0, 0), (1, 1, 1, 1, 1)])


def make(values=RAMP, **fields):
    return aus.Volume(values, **{"transfer": GREY, **fields})


# --- values --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "float32", "float64"])
def test_values_of_its_types_are_not_copied(dtype):
    values = RAMP.astype(dtype)
    volume = make(values)
    assert volume.values is values
    assert volume.shape == (6, 5, 4)
    assert volume.value_range == (0, 119)


@pytest.mark.parametrize(
    ("low", "high", "dtype"),
    [(0, 255, "uint8"), (-1, 127, "int8"), (-128, 128, "int16"), (0, 256, "uint16"), (-1, 32767, "int16"),
     (0, 65535, "uint16"), (-32768, 0, "int16")],
)  # fmt: skip
@pytest.mark.parametrize("wide", [np.int32, np.int64])
def test_wide_integers_become_the_smallest_type_that_holds_them(wide, low, high, dtype):
    values = np.full((2, 3, 4), low, wide)
    values[1, 2, 3] = high
    volume = make(values)
    assert volume.values.dtype == dtype
    assert np.array_equal(volume.values, values)


def test_other_kinds_of_numbers():
    assert make(RAMP > 50).values.dtype == np.uint8
    assert make(RAMP.astype(np.float16)).values.dtype == np.float32
    assert make(RAMP.astype(np.uint32)).values.dtype == np.uint8
    big = make(RAMP.astype(">i2"))
    assert big.values.dtype.isnative and np.array_equal(big.values, RAMP)
    turned = make(RAMP.T)
    assert turned.values.flags.c_contiguous and np.array_equal(turned.values, RAMP.T)
    assert make(RAMP.tolist()).values.shape == RAMP.shape


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.zeros((3, 3)), r"three axes \(z, y, x\), got shape \(3, 3\)"),
        (np.zeros((2, 3, 4, 5)), "got four, .* frames"),
        (np.zeros((1, 3, 4)), r"at least 2 voxels along each axis, got \(1, 3, 4\)"),
        (np.zeros((0, 3, 4)), "at least 2 voxels"),
        (np.zeros((2, 2, 2), complex), "got complex numbers"),
        (np.zeros((2, 2, 2), "U3"), "got text"),
        (np.full((2, 2, 2), 65536), r"65536…65536 \(int64\) do not fit into 16 bits"),
        (np.array([[[-1, 0], [0, 0]], [[0, 0], [0, 40000]]]), "-1…40000 .* do not fit"),
        ([[[0, 1], [2]]], "uneven rows"),
        (None, "got NoneType"),
    ],
)
def test_bad_values_are_refused(values, words):
    with pytest.raises(aus.InputError, match=words):
        make(values)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_voxels_that_are_not_finite_are_counted(bad):
    values = RAMP.copy()
    values[1, 2, 3] = values[3, 0, 0] = bad
    with pytest.raises(aus.InputError, match="NaN or infinity in 2 of 120 voxels"):
        make(values)


# --- geometry ------------------------------------------------------------------------------------------------------
def test_world_from_index_of_an_oblique_volume():
    turn = rotation((1, 2, 3), 40)[:3, :3]
    volume = make(spacing=(0.5, 2, 3), origin=(7, 8, 9), direction=turn, transform=translation(100, 0, 0))
    for index in np.ndindex(6, 5, 4):
        expected = turn @ (np.array(index) * (0.5, 2, 3)) + (107, 8, 9)
        assert np.allclose(apply(volume.world_from_index, [index]), expected)
    assert np.allclose(volume.object_from_index, translation(-100, 0, 0) @ volume.world_from_index)
    assert np.allclose(volume.voxel_size, (0.5, 2, 3))


def test_the_box_spans_voxel_centres():
    volume = make(spacing=(1, 2, 3), origin=(-1, -2, -3))
    assert np.array_equal(volume.bounds, [(-1, -2, -3), (4, 6, 6)])
    assert volume.diagonal == np.linalg.norm((5, 8, 9))
    assert np.array_equal(volume.corners[[0, 1, 2, 4]], [(-1, -2, -3), (4, -2, -3), (-1, 6, -3), (-1, -2, 6)])


@given(st.floats(0, 360), st.integers(0, 2))
def test_bounds_hold_all_voxels(angle, axis):
    volume = make(direction=rotation(np.eye(3)[axis], angle)[:3, :3], transform=rotation((1, 1, 0), 30))
    index = np.stack(np.meshgrid(range(6), range(5), range(4), indexing="ij"), -1).reshape(-1, 3)
    world = apply(volume.world_from_index, index)
    assert np.allclose(volume.bounds, [world.min(axis=0), world.max(axis=0)], atol=1e-12)


def test_diagonal_is_the_longest_of_a_sheared_box():
    sheared = np.column_stack([(1, 0, 0), (0.8, 0.6, 0), (0, 0, 1)])
    volume = make(direction=sheared)
    ends = volume.corners
    every = np.linalg.norm(ends[:, None] - ends[None], axis=2)
    assert volume.diagonal == pytest.approx(every.max())


def test_voxel_size_includes_the_transform():
    assert np.allclose(make(transform=np.diag([2, 3, 4, 1]), spacing=(1, 1, 0.5)).voxel_size, (2, 3, 2))


def test_scene_holds_volumes():
    volume = make()
    scene = aus.Scene((volume, aus.Mesh([(9, 0, 0), (9, 1, 0), (9, 0, 1)], [(0, 1, 2)])))
    assert scene.objects[0] is volume
    assert np.array_equal(scene.bounds, [(0, 0, 0), (9, 4, 3)])


# --- fields --------------------------------------------------------------------------------------------------------
def test_defaults():
    volume = aus.Volume(RAMP)
    assert volume.material == aus.Material() and volume.mode == "composite" and volume.shade and volume.iso is None
    assert np.array_equal(volume.transfer.points, aus.TransferFunction.suggest(volume).points)
    assert volume.clip_box is None and volume.clip_plane is None and volume.gradient == "central"
    assert np.array_equal(volume.direction, np.eye(3)) and np.array_equal(volume.transform, np.eye(4))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"spacing": (1, 0, 1)}, "spacing: expected numbers > 0"),
        ({"spacing": (1, np.nan, 1)}, "spacing"),
        ({"spacing": 1.0}, "spacing: expected three"),
        ({"spacing": (1e-300, 1, 1)}, "spacing: expected numbers ≥ 1e-30"),
        ({"spacing": (1e15, 1, 1)}, r"spacing: expected voxels of 1e-30 and more within ±1e\+15, got 1e\+15 × 1 × 1"),
        ({"transform": np.diag([1e-40, 1, 1, 1])}, "spacing: expected voxels of 1e-30 and more"),
        ({"origin": (1, 2)}, "origin: expected three"),
        ({"direction": np.eye(4)}, "direction: expected a 3×3"),
        ({"direction": np.diag([1, 2, 1])}, "unit length, found lengths 1, 2, 1"),
        ({"direction": np.ones((3, 3)) / np.sqrt(3)}, "singular"),
        ({"direction": "x"}, "direction"),
        ({"transfer": [(0, 0, 0, 0, 0)]}, "transfer: expected a TransferFunction, got list"),
        ({"mode": "xray"}, "mode: expected one of composite, mip, iso, got 'xray'"),
        ({"gradient": "prewitt"}, "gradient: expected one of central, sobel"),
        ({"shade": 1}, "shade"),
        ({"iso": "x"}, "iso"),
        ({"iso": np.nan}, "iso"),
        ({"material": 3}, "material"),
        ({"transform": np.diag([1, 0, 1, 1])}, "transform: .*singular"),
        ({"transform": np.eye(3)}, "transform"),
        ({"clip_box": (0, 1)}, "clip_box"),
        ({"clip_box": [(0, 0, 0), (1, 0, 1)]}, "clip_box: expected a lower and an upper corner"),
        ({"clip_box": [(0, 0, 0), (1, np.nan, 1)]}, "clip_box"),
        ({"clip_plane": (0, 0, 0, 1)}, "clip_plane: expected a normal"),
        ({"clip_plane": (0, 1, 0)}, "clip_plane: expected four"),
        ({"clip_plane": (0, 1, 0, np.inf)}, "clip_plane: expected four finite"),
    ],
)
def test_bad_fields_are_refused(fields, words):
    with pytest.raises(aus.InputError, match=words):
        make(**fields)


def test_fields_are_kept():
    volume = make(clip_box=[(0, 0, 0), (1, 2, np.inf)], clip_plane=(0, 0, 1, -1), iso=3, mode="iso", gradient="sobel")
    assert volume.clip_box.dtype == volume.clip_plane.dtype == np.float64
    assert volume.iso == 3.0
    other = replace(volume, mode="mip")
    assert other.values is volume.values and other.mode == "mip" and other.gradient == "sobel"


def test_an_arrays_later_fate_does_not_move_the_volume():
    direction = np.eye(3)
    volume = make(direction=direction)
    direction[:] = 0
    assert np.array_equal(volume.direction, np.eye(3))


# --- statistics ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("dtype", ["uint8", "int8", "int16", "uint16", "float32", "float64"])
@pytest.mark.parametrize("bins", [1, 7, 256])
def test_histogram_is_that_of_numpy(dtype, bins):
    values = np.random.default_rng(1).normal(0, 30, (7, 8, 9)).clip(-120, 120)
    values = (np.abs(values) if dtype[0] == "u" else values).astype(dtype)
    counts, edges = make(values).histogram(bins)
    expected, expected_edges = np.histogram(values, bins, range=(float(values.min()), float(values.max())))
    assert np.array_equal(edges, expected_edges)
    assert counts.sum() == values.size
    assert np.array_equal(counts, expected)


def test_histogram_of_a_constant():
    counts, _ = make(np.full((2, 2, 2), 5, np.uint8)).histogram(3)
    assert counts.sum() == 8 and np.count_nonzero(counts) == 1


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("value", [2.0**40, 1.0, -1e29, 1e-40, 0.0])
@pytest.mark.parametrize("steps", [0, 1, 2, 300])
def test_histogram_of_values_that_differ_by_roundings(dtype, value, steps):
    values = np.full((4, 4, 4), value, dtype)
    values[0, 0, 0] += steps * np.spacing(values[0, 0, 0])
    counts, edges = aus.Volume(values).histogram()
    assert counts.sum() == 64 and (np.diff(edges) > 0).all() and edges[0] <= value <= edges[-1]


def test_otsu_parts_two_peaks_in_the_middle():
    values = np.where(np.random.default_rng(0).random((20, 20, 20)) < 0.3, 200, 100).astype(np.uint8)
    assert make(values).otsu() == pytest.approx(150, abs=1)
    assert make(values, mode="iso").iso == make(values).otsu()
    assert make(values, mode="iso", iso=120).iso == 120


def test_otsu_is_the_best_of_all_thresholds():
    """Against the definition: the threshold with the greatest variance between classes (every value its own bin)."""
    rng = np.random.default_rng(2)
    values = np.concatenate([rng.normal(60, 12, 4000), rng.normal(170, 20, 2000)]).clip(0, 255).astype(np.uint8)
    values[:2] = 0, 255

    def variance(threshold):
        low = values < threshold
        return low.mean() * (1 - low.mean()) * (values[low].mean() - values[~low].mean()) ** 2

    best = max(range(1, 256), key=variance)
    found = make(values.reshape(10, 20, 30)).otsu()
    assert np.array_equal(values < found, values < best)


def test_otsu_of_a_constant_is_near_it():
    assert make(np.full((2, 2, 2), 5, np.uint8), mode="iso").iso == pytest.approx(5, abs=0.5)
