"""The vectors of `simd` as types of Numba's, and their operators: one LLVM instruction each, or a few."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from .simd import LANES


# --- types ----------------------------------------------------------------------------------------------------
class VectorType(types.Type):
    """Lanes of float32, float64, int32 or truth."""

    def __init__(self, name: str, scalar: Any, lanes: int = LANES) -> None:
        self.scalar, self.lanes = scalar, lanes
        super().__init__(name=f"{name}x{lanes}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by name: there is one of each kind, also in a cache of compiled kernels."""
        return _kind, (self.name,)


def _kind(name: str) -> VectorType:
    return {kind.name: kind for kind in (F32, F64, I32, MASK, EIGHT)}[name]


F32 = VectorType("float32", types.float32)
F64 = VectorType("float64", types.float64)
I32 = VectorType("int32", types.int32)
MASK = VectorType("bool", types.boolean)
EIGHT = F32 if LANES == 8 else VectorType("float32", types.float32, 8)
LLVM = {
    F32: ir.VectorType(ir.FloatType(), LANES),
    F64: ir.VectorType(ir.DoubleType(), LANES),
    I32: ir.VectorType(ir.IntType(32), LANES),
    MASK: ir.VectorType(ir.IntType(1), LANES),
    EIGHT: ir.VectorType(ir.FloatType(), 8),
}
OF_SCALAR = {types.float32: F32, types.float64: F64, types.int32: I32}


@register_model(VectorType)
class VectorModel(models.PrimitiveModel):
    """A vector lives in a register."""

    def __init__(self, dmm: Any, fe_type: VectorType) -> None:
        super().__init__(dmm, fe_type, LLVM[fe_type])


def element(builder: Any, index: Any, value: Any) -> Any:
    return builder.extract_element(value, ir.Constant(ir.IntType(32), index))


def repeat(builder: Any, value: Any, lanes: int = LANES) -> Any:
    """A scalar in every lane."""
    vector = ir.VectorType(value.type, lanes)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def widen(builder: Any, value: Any, kind: Any, lanes: int = LANES) -> Any:
    return value if isinstance(kind, VectorType) else repeat(builder, value, lanes)


# --- operators --------------------------------------------------------------------------------------------------
def _binary(op: Any, rules: dict[VectorType, tuple[VectorType, Callable[..., Any]]]) -> None:
    """Type and lower `op` for two vectors, or a vector and a scalar of its kind."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            a, b = args
            kind = a if isinstance(a, VectorType) else b
            if kind in rules and all(t is kind or t == kind.scalar for t in (a, b)):
                return signature(rules[kind][0], a, b)
            return None

    infer_global(op)(Template)
    for kind, (_, emit) in rules.items():
        pairs = [(kind, kind), (kind, kind.scalar), (kind.scalar, kind)]
        for pair in pairs:

            def lower(context: Any, builder: Any, sig: Any, args: Any, emit: Any = emit, kind: Any = kind) -> Any:
                a, b = (widen(builder, value, t, kind.lanes) for value, t in zip(args, sig.args, strict=True))
                return emit(builder, a, b)

            lower_builtin(op, *pair)(lower)


def _floats(emit: Callable[..., Any]) -> dict[VectorType, tuple[VectorType, Callable[..., Any]]]:
    return {F32: (F32, emit), F64: (F64, emit), EIGHT: (EIGHT, emit)}


def _ints(emit: Callable[..., Any]) -> dict[VectorType, tuple[VectorType, Callable[..., Any]]]:
    return {I32: (I32, emit)}


def _masks(emit: Callable[..., Any]) -> dict[VectorType, tuple[VectorType, Callable[..., Any]]]:
    return {MASK: (MASK, emit)}


def _compare(sign: str) -> dict[VectorType, tuple[VectorType, Callable[..., Any]]]:
    def ordered(b: Any, x: Any, y: Any) -> Any:
        return b.fcmp_ordered(sign, x, y)

    return {F32: (MASK, ordered), F64: (MASK, ordered), I32: (MASK, lambda b, x, y: b.icmp_signed(sign, x, y))}


_binary(operator.add, _floats(lambda b, x, y: b.fadd(x, y)) | _ints(lambda b, x, y: b.add(x, y)))
_binary(operator.sub, _floats(lambda b, x, y: b.fsub(x, y)) | _ints(lambda b, x, y: b.sub(x, y)))
_binary(operator.mul, _floats(lambda b, x, y: b.fmul(x, y)) | _ints(lambda b, x, y: b.mul(x, y)))
_binary(operator.truediv, _floats(lambda b, x, y: b.fdiv(x, y)))
_binary(operator.and_, _ints(lambda b, x, y: b.and_(x, y)) | _masks(lambda b, x, y: b.and_(x, y)))
_binary(operator.or_, _ints(lambda b, x, y: b.or_(x, y)) | _masks(lambda b, x, y: b.or_(x, y)))
_binary(operator.lshift, _ints(lambda b, x, y: b.shl(x, y)))
_binary(operator.rshift, _ints(lambda b, x, y: b.ashr(x, y)))
for _sign in ("<", "<=", ">", ">=", "=="):
    _binary({"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq}[_sign],
            _compare(_sign))
