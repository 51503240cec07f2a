"""The four channels of a texel at once: in plain Python, and as the vector instructions that it is compiled to.

Numba leaves LLVM's own way of finding them (SLP) off. Each lane does what `filtered` says, in that order, so that both
give the same bits.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable

CHANNELS = 4


def filtered(texels, a, b, c, d, s, t):
    """Texels a, b (below), c, d (above) of texels (T, 4), mixed bilinearly: four channels 0…255."""
    result = []
    for k in range(CHANNELS):
        below = (1.0 - s) * float(texels[a, k]) + s * float(texels[b, k])
        above = (1.0 - s) * float(texels[c, k]) + s * float(texels[d, k])
        result.append((1.0 - t) * below + t * above)
    return tuple(result)


@type_callable(filtered)
def _type_filtered(context: Any) -> Any:
    def of(texels: Any, a: Any, b: Any, c: Any, d: Any, s: Any, t: Any) -> Any:
        return types.UniTuple(types.float64, CHANNELS)

    return of


_BYTES = ir.VectorType(ir.IntType(8), CHANNELS)
_REALS = ir.VectorType(ir.DoubleType(), CHANNELS)


@lower_builtin(filtered, types.Array, *(types.Integer,) * 4, *(types.Float,) * 2)
def _lower_filtered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    array, *places = args
    data = context.make_array(sig.args[0])(context, builder, array).data
    index = ir.IntType(32)

    def every(value: Any) -> Any:
        first = builder.insert_element(ir.Constant(_REALS, ir.Undefined), value, ir.Constant(index, 0))
        return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(index, CHANNELS), [0] * CHANNELS))

    def texel(place: Any) -> Any:
        at = builder.gep(data, [builder.mul(place, ir.Constant(place.type, CHANNELS))])
        loaded = builder.load(builder.bitcast(at, _BYTES.as_pointer()))
        loaded.align = 1
        return builder.uitofp(loaded, _REALS)

    def mix(share: Any, first: Any, second: Any) -> Any:
        rest = every(builder.fsub(ir.Constant(ir.DoubleType(), 1.0), share))
        return builder.fadd(builder.fmul(rest, first), builder.fmul(every(share), second))

    a, b, c, d = (texel(context.cast(builder, places[i], sig.args[1 + i], types.int64)) for i in range(4))
    s, t = (context.cast(builder, places[i], sig.args[1 + i], types.float64) for i in (4, 5))
    mixed = mix(t, mix(s, a, b), mix(s, c, d))
    lanes = [builder.extract_element(mixed, ir.Constant(index, k)) for k in range(CHANNELS)]
    return cgutils.pack_array(builder, lanes)
