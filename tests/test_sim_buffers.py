"""Compression round trips, and what buffers read and write, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autostereo.simulator import Draw, Workload, simulate
from autostereo.simulator.kernels import codecs
from autostereo.simulator.textures import decode_bc1, encode_bc1
from sim_scenes import MULTI, RIG, SIZE, wall

SEEDS = st.integers(0, 2**32 - 1)


def plane(rng, steepness: float = 1e6) -> np.ndarray:
    """Rounded depths (8, 8) of a plane."""
    y, x = np.mgrid[:8, :8]
    z = rng.uniform(1e8, 4e9) + rng.uniform(-steepness, steepness) * x + rng.uniform(-steepness, steepness) * y
    return np.floor(np.clip(z, 0, 2**32 - 1)).astype(np.uint32)


def size_of(block: np.ndarray, codec) -> int:
    return codec(block, 0, 0, block.shape[1], block.shape[0], np.zeros((4, *block.shape), np.int64))


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.booleans())
def test_depth_differences_are_undone(seed, random):
    rng = np.random.default_rng(seed)
    block = rng.integers(0, 2**32, (8, 8), dtype=np.uint32) if random else plane(rng)
    differences, again = np.zeros((8, 8), np.int64), np.zeros((8, 8), np.int64)
    assert codecs.second_differences(block, 0, 0, 8, 8, differences)
    codecs.from_second_differences(differences, again)
    np.testing.assert_array_equal(again, block)


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_a_plane_takes_an_eighth(seed):
    assert size_of(plane(np.random.default_rng(seed)), codecs.depth_size) == 32


@settings(max_examples=50, deadline=None)
@given(SEEDS)
def test_two_planes_take_three_eighths_and_can_be_told_apart(seed):
    rng = np.random.default_rng(seed)
    first, second = plane(rng, 1e5).astype(np.int64), plane(rng, 1e5).astype(np.int64)
    y, x = np.mgrid[:8, :8]
    block = np.where(x + y < rng.integers(4, 11), first, second).astype(np.uint32)
    if abs(int(first[0, 0]) - int(second[0, 0])) < 1e7:
        return
    chosen, residual = np.zeros((8, 8), np.int64), np.zeros((8, 8), np.int64)
    assert codecs.two_planes(block, 0, 0, 8, 8, chosen, residual)
    assert size_of(block, codecs.depth_size) == 96
    z = block.astype(np.int64)  # the decoder: anchors, the plane's prediction, the residual
    from_start = z[0, 0] + x * (z[0, 1] - z[0, 0]) + y * (z[1, 0] - z[0, 0])
    from_end = z[7, 7] + (7 - x) * (z[7, 6] - z[7, 7]) + (7 - y) * (z[6, 7] - z[7, 7])
    np.testing.assert_array_equal(np.where(chosen == 0, from_start, from_end) + residual, z)


def test_noise_stays_as_it_is():
    block = np.random.default_rng(0).integers(0, 2**32, (8, 8), dtype=np.uint32)
    assert size_of(block, codecs.depth_size) == size_of(block, codecs.color_size) == 256


def rice_code(values: np.ndarray, k: int) -> str:
    """The bits themselves: a unary quotient, k bits of remainder."""
    folded = np.where(values >= 0, 2 * values, -2 * values - 1).ravel()
    remainders = [format(v & ((1 << k) - 1), f"0{k}b") if k else "" for v in folded]
    return "".join("1" * (v >> k) + "0" + r for v, r in zip(folded, remainders, strict=True))


def rice_decode(bits: str, k: int, count: int) -> list[int]:
    at, values = 0, []
    for _ in range(count):
        quotient = 0
        while bits[at] == "1":
            quotient, at = quotient + 1, at + 1
        at += 1
        folded = quotient << k | (int(bits[at : at + k], 2) if k else 0)
        at += k
        values.append(folded // 2 if folded % 2 == 0 else -(folded + 1) // 2)
    assert at == len(bits)
    return values


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.sampled_from([1, 8, 60, 256]))
def test_colours_are_coded_without_loss_in_as_many_bits_as_counted(seed, spread):
    rng = np.random.default_rng(seed)
    bytes_ = (rng.integers(0, 256, 4) + rng.integers(0, spread, (8, 8, 4))) % 256
    block = (bytes_ << (8 * np.arange(4))).sum(axis=2).astype(np.uint32)
    residuals, again = np.zeros((4, 8, 8), np.int64), np.zeros((8, 8), np.int64)
    codecs.color_residuals(block, 0, 0, 8, 8, residuals)
    total = 1
    for channel in residuals:
        folded = np.where(channel >= 0, 2 * channel, -2 * channel - 1).sum()
        if folded == 0:
            assert codecs.rice_bits(channel) == 4
            total += 4
            continue
        k = max(0, int(np.floor(np.log2(folded / 64)))) if folded >= 64 else 0
        code = rice_code(channel, k)
        assert rice_decode(code, k, 64) == channel.ravel().tolist()
        assert 4 + len(code) == codecs.rice_bits(channel)
        total += 4 + len(code)
    assert size_of(block, codecs.color_size) == min(256, -(-total // 256) * 32)
    codecs.from_color_residuals(residuals, again)
    np.testing.assert_array_equal(again, block)


def test_bc1_keeps_blocks_of_two_colours_and_stays_near_others():
    rng = np.random.default_rng(1)
    two = np.where(rng.integers(0, 2, (8, 12, 1)) == 1, [255, 255, 0], [0, 0, 255]).astype(np.uint8)
    np.testing.assert_array_equal(decode_bc1(encode_bc1(two), (8, 12))[..., :3], two)
    ramp = np.linspace(0, 255, 13 * 10).reshape(13, 10, 1).repeat(3, axis=2).astype(np.uint8)  # sides off the grid of 4
    error = np.abs(decode_bc1(encode_bc1(ramp), (13, 10))[..., :3].astype(int) - ramp)
    assert error.max() <= 16
    assert encode_bc1(ramp).shape == (4 * 3, 2)


FULL = {"compression": False}


@pytest.mark.parametrize("fast_clear", [True, False])
def test_a_wall_writes_every_block_once(fast_clear):
    """Two triangles over whole views, blocks that divide the picture: all is written once, and the diagonal again."""
    size, blocks = (64, 48), 5 * 8 * 6
    clear = {"fast_clear": fast_clear}
    machine = MULTI.with_(
        depth={**FULL, **clear, "bytes": 1 << 20, "z_max": False}, color={**FULL, **clear, "bytes": 1 << 20}
    )
    report = simulate(wall(), RIG, machine, size=size)
    written = blocks * 256 * (1 if fast_clear else 2)
    assert report.counters["color_written"] == report.counters["depth_written"] == written
    assert report.counters["color_read"] == 0  # every block was written as a whole
    assert report.counters["depth_read"] == (0 if fast_clear else blocks * 256)
    assert report.counters["depth_misses"] == blocks


def test_blending_reads_what_it_mixes_with():
    """A second layer in front: every block of the first has left a small cache, and is read again."""
    first = wall().draws[0]
    fields = vars(first) | {"corners": first.corners + np.array([0, 0, 0.5])}
    both = [Workload((first, Draw(**(fields | {"blend": blend}))), wall().textures) for blend in ("add", "replace")]
    machine = MULTI.with_(depth=FULL | {"z_max": False}, color=FULL)
    added, replaced = (simulate(workload, RIG, machine, size=(64, 48)) for workload in both)
    assert added.shaded.sum() == 2 * 5 * 64 * 48
    blocks = 5 * 8 * 6
    assert blocks * 256 * 0.8 < added.counters["color_read"] - replaced.counters["color_read"] <= blocks * 256


def test_compression_and_culling_save_bytes():
    plain = simulate(wall(0.1, 3), RIG, MULTI.with_(depth=FULL, color=FULL), size=SIZE)
    packed = simulate(wall(0.1, 3), RIG, MULTI, size=SIZE)
    assert packed.depth_bytes < 0.5 * plain.depth_bytes
    assert packed.color_bytes < plain.color_bytes
    assert plain.counters["depth_raw"] == packed.counters["depth_raw"]


def test_z_max_culls_what_is_hidden():
    """The same wall again, farther off: nothing of it is read."""
    front = wall()
    back = Draw(**(vars(front.draws[0]) | {"corners": 3 * (front.draws[0].corners - (0, 0, 5.0))}))
    hidden = Workload((front.draws[0], back), front.textures)
    alone = simulate(front, RIG, MULTI, size=(64, 48))
    both = simulate(hidden, RIG, MULTI, size=(64, 48))
    without = simulate(hidden, RIG, MULTI.with_(depth={"z_max": False}), size=(64, 48))
    np.testing.assert_array_equal(both.color, alone.color)
    np.testing.assert_array_equal(without.color, alone.color)
    assert both.counters["tiles_culled"] > 0
    assert both.depth_bytes < without.depth_bytes
    assert both.depth_bytes <= 1.1 * alone.depth_bytes
