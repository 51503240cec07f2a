"""How the functions of `simd` are compiled: one LLVM instruction each, or a few."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable

from . import simd
from .simd import LANES
from .simd_types import EIGHT, F32, F64, I32, LLVM, MASK, OF_SCALAR, VectorType, element, repeat, widen

binding.initialize_native_asmparser()  # one instruction is written as assembly


def _by_fours(order: tuple[int, ...]) -> tuple[int, ...]:
    """An order of four lanes, repeated for every four."""
    return tuple(4 * k + i for k in range(LANES // 4) for i in order)


SHUFFLES: dict[Callable[..., Any], tuple[int, ...]] = {
    simd.low_halves: _by_fours((0, LANES, 1, LANES + 1)),
    simd.high_halves: _by_fours((2, LANES + 2, 3, LANES + 3)),
    simd.low_pairs: _by_fours((0, 1, LANES, LANES + 1)),
    simd.high_pairs: _by_fours((2, 3, LANES + 2, LANES + 3)),
    simd.first_in_turn: tuple(k // 2 + LANES * (k % 2) for k in range(LANES)),
    simd.last_in_turn: tuple((LANES + k) // 2 + LANES * (k % 2) for k in range(LANES)),
    simd.even_lanes: tuple(range(0, 2 * LANES, 2)),
}


def _function(function: Any, accepts: Callable[..., Any], emit: Callable[..., Any]) -> None:
    """Type `function` by `accepts(*argument types)`, a result type or None, and lower it by `emit`."""

    def typer_for(context: Any) -> Any:
        return _fixed(accepts)

    type_callable(function)(typer_for)
    count = accepts.__code__.co_argcount
    lower_builtin(function, *[types.Any] * count)(emit)


def _fixed(accepts: Callable[..., Any]) -> Callable[..., Any]:
    """`accepts` under the fixed signature that Numba wants of a typer."""
    count = accepts.__code__.co_argcount
    signatures: list[Callable[..., Any]] = [
        lambda: accepts(),
        lambda a: accepts(a),
        lambda a, b: accepts(a, b),
        lambda a, b, c: accepts(a, b, c),
        lambda a, b, c, d: accepts(a, b, c, d),
        lambda a, b, c, d, e: accepts(a, b, c, d, e),
    ]
    return signatures[count]


def _pointer(context: Any, builder: Any, kind: Any, array: Any, index: Any, index_type: Any) -> Any:
    """Address of an element of a contiguous one-dimensional array."""
    view = context.make_array(kind)(context, builder, array)
    wide = context.cast(builder, index, index_type, types.uintp)
    return builder.gep(view.data, [wide])


def _vector_of(array: Any) -> Any:
    return OF_SCALAR.get(array.dtype) if isinstance(array, types.Array) and array.ndim == 1 else None


def _holds(array: Any, vector: Any) -> bool:
    """Whether `store` takes them."""
    kind = _vector_of(array)
    return kind is not None and (vector is kind or (vector is EIGHT and kind is F32))


def _splits(array: Any) -> bool:
    """Whether `adjacent` takes the array."""
    kinds = (types.uint8, types.uint16, types.uint32, types.float32)
    return isinstance(array, types.Array) and array.ndim == 1 and array.dtype in kinds


def _emit_load(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[1])
    place = builder.bitcast(pointer, LLVM[sig.return_type].as_pointer())
    return builder.load(place, align=sig.return_type.scalar.bitwidth // 8)


def _emit_adjacent(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[1])
    size = sig.args[0].dtype.bitwidth
    both = builder.load(builder.bitcast(pointer, ir.IntType(2 * size).as_pointer()), align=size // 8)
    return both if size == 32 else builder.zext(both, ir.IntType(64))


def _emit_store(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[1])
    align = sig.args[2].scalar.bitwidth // 8
    builder.store(args[2], builder.bitcast(pointer, args[2].type.as_pointer()), align=align)
    return context.get_dummy_value()


def _emit_stream(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[1])
    kind = ir.VectorType(args[2].type.element, 4)
    flag = builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
    for k in range(0, LANES, 4):
        order = ir.Constant(ir.VectorType(ir.IntType(32), 4), [k + i for i in range(4)])
        part = builder.shuffle_vector(args[2], args[2], order)
        place = builder.gep(pointer, [ir.Constant(ir.IntType(64), k)])
        if _has_avx2():  # said outright: LLVM for AVX-512 merges shuffle and store, and forgets to pass the caches
            call = ir.FunctionType(ir.VoidType(), [place.type, kind])
            builder.asm(call, "vmovntdq $1, ($0)", "r,x,~{memory}", [place, part], side_effect=True)
        else:
            builder.store(part, builder.bitcast(place, kind.as_pointer()), align=16).set_metadata("nontemporal", flag)
    return context.get_dummy_value()


def _has_avx2() -> bool:
    """Whether AVX2's instructions may be said outright, and where there are sixteen lanes AVX-512's."""
    return simd.has_feature("avx2")


def _emit_append(context, builder, sig, args):
    array, index, vector, mask = args
    wide = context.cast(builder, index, sig.args[1], types.uint64)
    data = context.make_array(sig.args[0])(context, builder, array).data
    word, byte = ir.IntType(32), ir.IntType(8)
    number = builder.bitcast(mask, ir.IntType(LANES))
    if LANES == 16 and _has_avx2():
        packed = _intrinsic(builder, "llvm.x86.avx512.mask.compress.v16i32", vector.type, vector, vector, mask)
        builder.store(packed, builder.bitcast(builder.gep(data, [wide]), vector.type.as_pointer()), align=4)
        return builder.add(wide, builder.zext(builder.ctpop(number), wide.type))
    if not _has_avx2():
        for k in range(LANES):
            builder.store(element(builder, k, vector), builder.gep(data, [wide]))
            wide = builder.add(wide, builder.zext(element(builder, k, mask), wide.type))
        return wide
    orders = [[k for k in range(LANES) if m >> k & 1] for m in range(256)]
    table = ir.Constant(ir.ArrayType(byte, 256 * LANES), [k for o in orders for k in (o + [0] * LANES)[:LANES]])
    place = builder.gep(
        cgutils.global_constant(builder, "orders", table),
        [ir.Constant(word, 0), builder.mul(builder.zext(number, word), ir.Constant(word, LANES))],
    )
    order = builder.load(builder.bitcast(place, ir.VectorType(byte, LANES).as_pointer()), align=1)
    packed = _intrinsic(builder, "llvm.x86.avx2.permd", vector.type, vector, builder.zext(order, vector.type))
    builder.store(packed, builder.bitcast(builder.gep(data, [wide]), vector.type.as_pointer()), align=4)
    return builder.add(wide, builder.zext(builder.ctpop(number), wide.type))


def _emit_keep_greater(context, builder, sig, args):
    pair = ir.VectorType(ir.IntType(64), 2)
    places = [builder.extract_value(args[1], i) for i in range(2)]
    pointers = [_pointer(context, builder, sig.args[0], args[0], place, sig.args[1].dtype) for place in places]
    pointers.append(_pointer(context, builder, sig.args[2], args[2], args[3], sig.args[3]))
    again, target, source = (builder.bitcast(pointer, pair.as_pointer()) for pointer in pointers)
    old, new = builder.load(again, align=8), builder.load(source, align=8)
    mask = builder.insert_element(ir.Constant(pair, ir.Undefined), args[4], ir.Constant(ir.IntType(32), 0))
    mask = builder.shuffle_vector(mask, mask, ir.Constant(ir.VectorType(ir.IntType(32), 2), [0, 0]))
    chosen = builder.select(builder.icmp_signed(">", new, builder.or_(old, mask)), new, old)
    builder.store(chosen, target, align=8)
    return context.get_dummy_value()


def _emit_prefetch(context, builder, sig, args):
    pointer = _pointer(context, builder, sig.args[0], args[0], args[1], sig.args[1])
    byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
    kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
    function = builder.module.declare_intrinsic("llvm.prefetch", (byte,), kind)
    read, keep, data = (ir.Constant(word, value) for value in (0, 3, 1))
    builder.call(function, [builder.bitcast(pointer, byte), read, keep, data])
    return context.get_dummy_value()


def _emit_gather(context, builder, sig, args):
    data = context.make_array(sig.args[0])(context, builder, args[0]).data
    result = ir.Constant(LLVM[sig.return_type], ir.Undefined)
    for k in range(LANES):
        index = builder.zext(element(builder, k, args[1]), ir.IntType(64))
        value = builder.load(builder.gep(data, [index]))
        result = builder.insert_element(result, value, ir.Constant(ir.IntType(32), k))
    return result


def _emit_call(name: str) -> Callable[..., Any]:
    def emit(context, builder, sig, args):
        return _intrinsic(builder, f"llvm.{name}.v{LANES}f32", args[0].type, args[0])

    return emit


def _emit_fused(context, builder, sig, args):
    a, b, c = (widen(builder, value, t) for value, t in zip(args, sig.args, strict=True))
    return _intrinsic(builder, f"llvm.fmuladd.v{LANES}f32", a.type, a, b, c)


def _intrinsic(builder: Any, name: str, result: Any, *args: Any) -> Any:
    kind = ir.FunctionType(result, [value.type for value in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)


def _estimate(builder: Any, name: str, value: Any) -> Any:
    """What the processor's instruction `name` (rcp or rsqrt) gives: 12 or 14 bits."""
    vector = value.type
    if LANES == 8:
        return _intrinsic(builder, f"llvm.x86.avx.{name}.ps.256", vector, value)
    zero, all_lanes = ir.Constant(vector, None), ir.Constant(ir.IntType(16), -1)
    return _intrinsic(builder, f"llvm.x86.avx512.{name}14.ps.512", vector, value, zero, all_lanes)


def _emit_reciprocal(context, builder, sig, args):
    vector, fused = args[0].type, f"llvm.fmuladd.v{LANES}f32"
    one = ir.Constant(vector, [1.0] * LANES)
    if not _has_avx2():
        return builder.fdiv(one, args[0])
    near = _estimate(builder, "rcp", args[0])
    off = _intrinsic(builder, fused, vector, builder.fneg(args[0]), near, one)  # Newton's step
    return _intrinsic(builder, fused, vector, near, off, near)


def _emit_inverse_sqrt(context, builder, sig, args):
    vector, fused = args[0].type, f"llvm.fmuladd.v{LANES}f32"
    one, half = (ir.Constant(vector, [value] * LANES) for value in (1.0, 0.5))
    if not _has_avx2():
        return builder.fdiv(one, _intrinsic(builder, f"llvm.sqrt.v{LANES}f32", vector, args[0]))
    near = _estimate(builder, "rsqrt", args[0])
    off = _intrinsic(builder, fused, vector, builder.fneg(builder.fmul(args[0], near)), near, one)
    return _intrinsic(builder, fused, vector, builder.fmul(near, half), off, near)


def _emit_pack_bytes(context, builder, sig, args):
    r, g, b = args
    word = ir.IntType(32)
    if not _has_avx2():
        low, high = (ir.Constant(r.type, [value] * LANES) for value in (0, 255))
        r, g, b = (builder.select(builder.icmp_signed(">", c, low), c, low) for c in args)
        r, g, b = (builder.select(builder.icmp_signed("<", c, high), c, high) for c in (r, g, b))
        shift = [ir.Constant(r.type, [value] * LANES) for value in (8, 16, -1 << 24)]
        return builder.or_(builder.or_(r, shift[2]), builder.or_(builder.shl(g, shift[0]), builder.shl(b, shift[1])))
    shorts, many = ir.VectorType(ir.IntType(16), 2 * LANES), ir.VectorType(ir.IntType(8), 4 * LANES)
    family, size = ("avx512", ".512") if LANES == 16 else ("avx2", "")
    alpha = ir.Constant(r.type, [255] * LANES)
    rg = _intrinsic(builder, f"llvm.x86.{family}.packssdw{size}", shorts, r, g)
    ba = _intrinsic(builder, f"llvm.x86.{family}.packssdw{size}", shorts, b, alpha)
    apart = _intrinsic(builder, f"llvm.x86.{family}.packuswb{size}", many, rg, ba)  # of four lanes r, then g, b, a
    order = [16 * k + 4 * c + i for k in range(LANES // 4) for i in range(4) for c in range(4)]
    mixed = builder.shuffle_vector(apart, apart, ir.Constant(ir.VectorType(word, 4 * LANES), order))
    return builder.bitcast(mixed, r.type)


def _emit_choice(sign: str) -> Callable[..., Any]:
    def emit(context, builder, sig, args):
        a, b = (widen(builder, value, t) for value, t in zip(args, sig.args, strict=True))
        compare = builder.icmp_signed if sig.return_type is I32 else builder.fcmp_ordered
        return builder.select(compare(sign, a, b), a, b)

    return emit


def _emit_to_float(context, builder, sig, args):
    convert = builder.sitofp if sig.args[0] is I32 else builder.fptrunc
    return convert(args[0], LLVM[F32])


def _emit_select(context, builder, sig, args):
    a, b = (widen(builder, value, t) for value, t in zip(args[1:], sig.args[1:], strict=True))
    return builder.select(args[0], a, b)


def _emit_mask_word(context, builder, sig, args):
    return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(32))


def _emit_lane(context, builder, sig, args):
    return builder.extract_element(args[0], context.cast(builder, args[1], sig.args[1], types.int32))


def _emit_shuffle(order: tuple[int, ...]) -> Callable[..., Any]:
    def emit(context, builder, sig, args):
        mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), list(order))
        return builder.shuffle_vector(args[0], args[1], mask)

    return emit


def _both(a: Any, b: Any) -> Any:
    """The vector that two arguments make, one of them perhaps a scalar of its kind."""
    kind = a if isinstance(a, VectorType) else b
    fits = isinstance(kind, VectorType) and kind.lanes == LANES and all(t is kind or t == kind.scalar for t in (a, b))
    return kind if fits else None


_function(simd.load, lambda array, index: _vector_of(array), _emit_load)
_function(simd.load_eight, lambda array, index: EIGHT if _vector_of(array) is F32 else None, _emit_load)
_function(simd.adjacent, lambda array, index: types.int64 if _splits(array) else None, _emit_adjacent)
_function(
    simd.store,
    lambda array, index, vector: types.none if _holds(array, vector) else None,
    _emit_store,
)
_function(
    simd.keep_greater,
    lambda array, places, words, k, mask: types.none if array.dtype == words.dtype == mask == types.int64 else None,
    _emit_keep_greater,
)
_function(
    simd.append,
    lambda array, index, vector, mask: types.uint64 if _vector_of(array) is vector is I32 and mask is MASK else None,
    _emit_append,
)
_function(simd.prefetch, lambda array, index: types.none if isinstance(array, types.Array) else None, _emit_prefetch)
_function(simd.stream, lambda array, index, vector: types.none if _vector_of(array) is vector else None, _emit_stream)
_function(simd.gather, lambda array, indices: _vector_of(array) if indices is I32 else None, _emit_gather)
_function(simd.splat, lambda value: OF_SCALAR.get(value), lambda c, b, s, a: repeat(b, a[0]))
_function(simd.iota, lambda: I32, lambda c, b, s, a: ir.Constant(LLVM[I32], list(range(LANES))))
_function(simd.select, lambda mask, a, b: _both(a, b) if mask is MASK else None, _emit_select)
_function(simd.lesser, lambda a, b: _both(a, b), _emit_choice("<"))
_function(simd.greater, lambda a, b: _both(a, b), _emit_choice(">"))
_function(
    simd.fused,
    lambda a, b, c: F32 if F32 in (a, b, c) and all(t in (F32, types.float32) for t in (a, b, c)) else None,
    _emit_fused,
)
_function(simd.reciprocal, lambda a: F32 if a is F32 else None, _emit_reciprocal)
_function(simd.inverse_sqrt, lambda a: F32 if a is F32 else None, _emit_inverse_sqrt)
_function(simd.pack_bytes, lambda r, g, b: I32 if r is g is b is I32 else None, _emit_pack_bytes)
for _name, _call in (("floor", simd.floor), ("ceil", simd.ceil)):
    _function(_call, lambda a: F32 if a is F32 else None, _emit_call(_name))
_function(simd.to_int, lambda a: I32 if a is F32 else None, lambda c, b, s, a: b.fptosi(a[0], LLVM[I32]))
_function(simd.to_float, lambda a: F32 if a is I32 or a is F64 else None, _emit_to_float)
_function(simd.bits, lambda a: I32 if a is F32 else None, lambda c, b, s, a: b.bitcast(a[0], LLVM[I32]))
_function(simd.from_bits, lambda a: F32 if a is I32 else None, lambda c, b, s, a: b.bitcast(a[0], LLVM[F32]))
_function(simd.mask_word, lambda mask: types.int32 if mask is MASK else None, _emit_mask_word)
_function(simd.lane, lambda vector, k: vector.scalar if isinstance(vector, VectorType) else None, _emit_lane)
for _shuffle, _order in SHUFFLES.items():
    _function(_shuffle, lambda a, b: a if a is b and isinstance(a, VectorType) else None, _emit_shuffle(_order))
