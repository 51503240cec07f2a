"""Explicit SIMD: what is compiled gives the bits that the plain definition in NumPy gives."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from autostereo.engines.cpu.jit import kernel
from autostereo.engines.cpu.simd import (
    LANES,
    adjacent,
    append,
    bits,
    ceil,
    even_lanes,
    first_in_turn,
    floor,
    from_bits,
    fused,
    gather,
    greater,
    high_halves,
    high_pairs,
    inverse_sqrt,
    iota,
    keep_greater,
    lane,
    last_in_turn,
    lesser,
    load,
    load_eight,
    low_halves,
    low_pairs,
    mask_word,
    pack_bytes,
    prefetch,
    reciprocal,
    select,
    splat,
    store,
    stream,
    to_float,
    to_int,
)

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="the JIT is off: nothing to compare"
)

floats = arrays(np.float32, 2 * LANES, elements=st.floats(-1e6, 1e6, width=32))
doubles = arrays(np.float64, 2 * LANES, elements=st.floats(-1e9, 1e9))
ints = arrays(np.int32, 2 * LANES, elements=st.integers(-(2**20), 2**20))
words = arrays(np.int64, 8, elements=st.integers(-(2**62), 2**62))


def arithmetic(a, out):
    """Every operator and function of float32."""
    x, y = load(a, 0), load(a, LANES)
    results = (
        x + y, x - y, x * y, x / y, x * np.float32(3.0), np.float32(2.0) - y, lesser(x, y), greater(x, y),
        floor(x), ceil(y), select(x < y, x, y), select(x >= y, x, np.float32(7.0)),
        from_bits(bits(x)), to_float(to_int(x)), splat(a[3]), gather(a, iota() + np.int32(5)),
        low_halves(x, y), high_halves(x, y), low_pairs(x, y), high_pairs(x, y), first_in_turn(x, y), last_in_turn(x, y),
        even_lanes(x, y), lesser(greater(x, np.float32(-1.0)), np.float32(1.0)),
    )  # fmt: skip
    for k in range(len(results)):
        store(out, k * LANES, results[k])
    prefetch(a, 3)
    return mask_word(x < y), mask_word((x <= y) & (y > x)), mask_word((x == y) | (x > y)), lane(x, 5)


def doubles_of(a, out, narrow):
    """Operators of float64, and rounding to float32."""
    x, y = load(a, 0), load(a, LANES)
    results = (x + y, x - y, x * y, x / y, 1.5 * x, splat(a[2]), select(x < y, x, y), gather(a, iota()))
    for k in range(len(results)):
        store(out, k * LANES, results[k])
    store(narrow, 0, to_float(x))
    return mask_word(x >= y)


def whole_numbers(a, out):
    """Operators of int32."""
    x, y = load(a, 0), load(a, LANES)
    results = (
        x + y, x - y, x * y, x & y, x | np.int32(5), x << np.int32(3), x >> np.int32(2), iota(), lesser(x, y),
        greater(x, np.int32(3)), select(x == y, x, np.int32(-1)), gather(a, iota()),
    )  # fmt: skip
    for k in range(len(results)):
        store(out, k * LANES, results[k])
    return mask_word(x > y)


def kept(target, new, mask):
    """keep_greater on every pair of words."""
    for k in range(0, 8, 2):
        keep_greater(target, (np.uint64(k), np.uint64(k)), new, k, mask)


def listed(a, limit, out):
    """append: lanes above a limit, one behind the other."""
    n = np.uint64(0)
    for k in range(0, a.shape[0], LANES):
        x = load(a, k)
        n = append(out, n, x, x > limit)
    return n


def streamed(a, out):
    """stream: as store."""
    stream(out, 0, load(a, LANES))


def neighbours(a, out):
    """adjacent: each element and the next."""
    for k in range(out.shape[0]):
        out[k] = adjacent(a, np.uint64(k))


def product_and_sum(a, b, c, out):
    """fused of vectors, and with a scalar."""
    store(out, 0, fused(load(a, 0), load(b, 0), load(c, 0)))
    store(out, LANES, fused(load(a, 0), b[1], load(c, 0)))


def one_through(a, out):
    """reciprocal of all lanes."""
    store(out, 0, reciprocal(load(a, 0)))


def one_through_root(a, out):
    """inverse_sqrt of all lanes."""
    store(out, 0, inverse_sqrt(load(a, 0)))


def packed(r, g, b, out):
    """pack_bytes of all lanes."""
    store(out, 0, pack_bytes(load(r, 0), load(g, 0), load(b, 0)))


def of_eight(a, out):
    """Arithmetic of eight lanes, whatever others have, and with scalars."""
    x, y = load_eight(a, 0), load_eight(a, 8)
    store(out, 0, (x + y) * x - y)
    store(out, 8, (x - a[3]) * np.float32(0.5) + y)


KERNELS = (
    arithmetic, doubles_of, whole_numbers, kept, listed, streamed, neighbours, product_and_sum, one_through,
    one_through_root, packed, of_eight,
)  # fmt: skip
COMPILED = {f.__name__: kernel(f) for f in KERNELS}


def same(a: np.ndarray, b: np.ndarray) -> None:
    """Equal to the bit, NaN included."""
    np.testing.assert_array_equal(a.view(np.uint8), b.view(np.uint8))


def assert_compiled_as_defined(function, a: np.ndarray, *outputs: np.ndarray) -> None:
    """What `function` returns and writes into outputs is the same compiled and not; NaN where NaN is."""
    wanted = [np.zeros_like(out) for out in outputs]
    got = COMPILED[function.__name__](a, *outputs)
    with np.errstate(all="ignore"):
        assert got == function(a, *wanted)
    for out, right in zip(outputs, wanted, strict=True):
        nan = np.isnan(right)
        np.testing.assert_array_equal(np.isnan(out), nan)
        same(out[~nan], right[~nan])


@given(floats)
@settings(deadline=None, max_examples=60)
def test_floats(a: np.ndarray) -> None:
    assert_compiled_as_defined(arithmetic, a, np.zeros(24 * LANES, np.float32))


@given(doubles)
@settings(deadline=None, max_examples=60)
def test_doubles(a: np.ndarray) -> None:
    assert_compiled_as_defined(doubles_of, a, np.zeros(8 * LANES), np.zeros(LANES, np.float32))


@given(ints)
@settings(deadline=None, max_examples=60)
def test_whole_numbers(a: np.ndarray) -> None:
    assert_compiled_as_defined(whole_numbers, a, np.zeros(12 * LANES, np.int32))


@given(words, words, st.sampled_from([0, 0xFFFFFFFF]))
@settings(deadline=None, max_examples=60)
def test_keep_greater(old: np.ndarray, new: np.ndarray, mask: int) -> None:
    target, wanted = old.copy(), old.copy()
    COMPILED["kept"](target, new, np.int64(mask))
    kept(wanted, new, np.int64(mask))
    same(target, wanted)
    same(target, np.where(new > (old | mask), new, old))


@pytest.mark.parametrize("generic", [False, True])
@given(ints, st.integers(-1000, 1000))
@settings(deadline=None, max_examples=40)
def test_append(generic: bool, a: np.ndarray, limit: int) -> None:
    """By AVX2's table or AVX-512's compression, and by the form for other processors."""
    run = generic_listed() if generic else COMPILED["listed"]
    out = np.zeros(4 * LANES, np.int32)
    n = run(a, np.int32(limit), out)
    np.testing.assert_array_equal(out[:n], a[a > limit])


@functools.cache
def generic_listed():
    """`listed` compiled as for a processor without AVX2."""
    from numba import njit

    from autostereo.engines.cpu import simd_compiled

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simd_compiled, "_has_avx2", lambda: False)
        compiled = njit(listed)
        compiled(np.zeros(LANES, np.int32), np.int32(0), np.zeros(4 * LANES, np.int32))
    return compiled


@functools.cache
def generic_packed():
    """`packed` compiled as for a processor without AVX2."""
    from numba import njit

    from autostereo.engines.cpu import simd_compiled

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simd_compiled, "_has_avx2", lambda: False)
        compiled = njit(packed)
        compiled(*np.zeros((4, LANES), np.int32))
    return compiled


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32, np.float32])
def test_adjacent(kind: type) -> None:
    bytes_of = np.random.default_rng(5).integers(0, 256, 20 * np.dtype(kind).itemsize, dtype=np.uint8)
    a, got, wanted = bytes_of.view(kind), np.zeros(19, np.int64), np.zeros(19, np.int64)
    COMPILED["neighbours"](a, got)
    neighbours(a, wanted)
    np.testing.assert_array_equal(got, wanted)
    narrow = got.astype(np.uint64) & np.uint64(2 ** (8 * a.itemsize) - 1)
    np.testing.assert_array_equal(narrow.astype(f"u{a.itemsize}"), a[:-1].view(f"u{a.itemsize}"))


@given(floats, floats)
@settings(deadline=None, max_examples=60)
def test_fused_is_rounded_once_or_twice(a: np.ndarray, b: np.ndarray) -> None:
    x, y, z, out = a[:LANES], a[LANES:], b[:LANES], np.zeros((2, LANES), np.float32)
    COMPILED["product_and_sum"](x, y, z, out.ravel())
    y = np.stack([y, np.full(LANES, y[1])])
    once = (x.astype(np.float64) * y + z).astype(np.float32)  # the product is exact, the sum rounded to 53 bits
    twice = x * y + z
    near = np.abs(out - once) <= np.spacing(np.abs(once))
    assert (near | (out == twice)).all()


def test_stream_stores() -> None:
    a = np.arange(2 * LANES, dtype=np.int32)
    room = np.zeros(4 * LANES, np.int32)
    start = -room.ctypes.data % 16 // 4
    COMPILED["streamed"](a, room[start:])
    np.testing.assert_array_equal(room[start : start + LANES], a[LANES:])


def test_vectors_survive_a_cache() -> None:
    """Kinds are pickled by name, so that kernels loaded from a cache know them."""
    import pickle

    from autostereo.engines.cpu.simd_types import EIGHT, F32, F64, I32, MASK

    assert all(pickle.loads(pickle.dumps(kind)) is kind for kind in (F32, F64, I32, MASK, EIGHT))


@given(arrays(np.float32, LANES, elements=st.floats(2.0**-100, 2.0**100, width=32)), st.sampled_from([-1.0, 1.0]))
@settings(deadline=None, max_examples=60)
def test_reciprocal(a: np.ndarray, sign: float) -> None:
    """Within two units in the last place."""
    out = np.zeros(LANES, np.float32)
    COMPILED["one_through"](a * np.float32(sign), out)
    right = sign / a.astype(np.float64)
    assert (np.abs(out - right) <= 2 * np.spacing(np.abs(right).astype(np.float32))).all()
    COMPILED["one_through_root"](a, out)
    right = 1.0 / np.sqrt(a.astype(np.float64))
    assert (np.abs(out - right) <= 2 * np.spacing(right.astype(np.float32))).all()


wide_ints = arrays(np.int32, LANES, elements=st.integers(-(2**31), 2**31 - 1))


@pytest.mark.parametrize("generic", [False, True])
@given(wide_ints, ints, wide_ints)
@settings(deadline=None, max_examples=60)
def test_pack_bytes(generic: bool, r: np.ndarray, g: np.ndarray, b: np.ndarray) -> None:
    """By AVX2's or AVX-512's saturation, and by comparisons."""
    run = generic_packed() if generic else COMPILED["packed"]
    out, wanted = np.zeros((2, LANES), np.int32)
    run(r, g, b, out)
    packed(r, g, b, wanted)
    np.testing.assert_array_equal(out, wanted)
    of_bytes = out.view(np.uint8).reshape(LANES, 4)
    np.testing.assert_array_equal(of_bytes[:, 0], np.clip(r, 0, 255))
    np.testing.assert_array_equal(of_bytes[:, 3], 255)


@given(arrays(np.float32, 16, elements=st.floats(-1e6, 1e6, width=32)))
@settings(deadline=None, max_examples=60)
def test_eight_lanes(a: np.ndarray) -> None:
    out, wanted = np.zeros((2, 16), np.float32)
    COMPILED["of_eight"](a, out)
    of_eight(a, wanted)
    same(out, wanted)


@pytest.mark.skipif(
    any(os.environ.get(f"NUMBA_{name}") for name in ("CPU_NAME", "CPU_FEATURES", "ENABLE_AVX")),
    reason="kernels are compiled for another processor than this",
)
def test_as_many_lanes_as_the_processor_has() -> None:
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    assert LANES == (16 if all(features.get(f"avx512{part}") for part in ("f", "vl", "bw", "dq")) else 8)


@pytest.mark.parametrize("setting", ["NUMBA_ENABLE_AVX=0", "NUMBA_CPU_NAME=generic"])
def test_processors_without_avx(setting: str) -> None:
    """No instruction that they lack is compiled, and the estimates are as near."""
    code = """
import numpy as np
from numba import njit
from autostereo.engines.cpu import jit, simd  # jit: numba knows the vectors
@njit
def estimates(a, r, out, words):
    x, y = simd.load(a, 0), simd.load(r, 0)
    simd.store(out, 0, simd.reciprocal(x))
    simd.store(out, simd.LANES, simd.inverse_sqrt(x))
    simd.store(words, 0, simd.pack_bytes(y, y, y))
    return simd.append(words, simd.LANES, y, x > np.float32(3.0))
a, r = np.linspace(0.5, 9, 8, dtype=np.float32), np.arange(-300, 500, 100, dtype=np.int32)
out, words = np.zeros(16, np.float32), np.zeros(16, np.int32)
n = estimates(a, r, out, words)
assert simd.LANES == 8 and n == 8 + (a > 3).sum() and (words[8:n] == r[a > 3]).all()
assert np.allclose(out, [*(1 / a), *a**-0.5], rtol=3e-7) and (words[:8] & 255 == np.clip(r, 0, 255)).all()
"""
    name, value = setting.split("=")
    paths = os.pathsep.join(p for p in sys.path if p)
    run = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {name: value, "PYTHONPATH": paths},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr[-2000:]


@pytest.mark.skipif(LANES == 8, reason="this processor has no AVX-512: eight lanes are what all tests run with")
def test_eight_lanes_where_there_is_no_avx512() -> None:
    """These tests, and views and panels against the reference, as on a processor without AVX-512."""
    here = Path(__file__).parent
    files = here / "test_simd.py", here / "agreement" / "test_mesh_agreement.py"
    plugins = "-p", "without_avx512", "-p", "no:cacheprovider"
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *plugins, "-k", "simd or (of_the_reference and cpu)", *files],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(here), *sys.path])},
        capture_output=True, text=True, check=False, cwd=here.parent,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout[-4000:]
    assert int(re.findall(r"(\d+) passed", run.stdout)[-1]) > 60
