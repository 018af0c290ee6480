"""Tables of functions that are too dear for every ray: on regular grids, linear in between, differentiable throughout.

By gathers of all channels of a node at once, in the precision of the arrays: as fast as Dr.Jit's textures on LLVM, and
without the 8-bit weights of a GPU's own interpolation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .. import llvm
from ..errors import ParameterError
from .numerics import clamp


@dataclass
class Table:
    """A function on [0, 1]^n, n = 1, 2 or 3, with any number of channels; a power of two of them is read at once.

    Derivatives by coordinates and entries are those of the interpolation: between nodes, constant along an axis. If a
    recorded loop takes a table from around it, that is part of what the loop captures (see `quadrature.accumulate`).
    """

    entries: Any  # flat, channels innermost: Dr.Jit's, or a list for coordinates that are plain floats
    shape: tuple[int, ...]  # nodes along each axis, evenly from 0 to 1; what has one node is constant along that axis
    channels: int

    @classmethod
    def of(cls, shape: Sequence[int], channels: Sequence[Any]) -> Table:
        """The table of these ``channels``, each a flat Dr.Jit array of all nodes, those of the last axis innermost."""
        if not (1 <= len(shape) <= 3 and channels and all(dr.width(one) == prod(shape) > 0 for one in channels)):
            widths = [dr.width(one) for one in channels]
            raise ParameterError(
                f"table: {tuple(shape)} nodes, {widths} values; expected one to three axes, all nodes."
            )
        entries = dr.ravel(_arrays(type(channels[0]))(channels))
        dr.eval(entries)
        return cls(entries, tuple(shape), len(channels))

    def native(self) -> Table:
        """The table for the active variant, in a scalar one of plain floats."""
        return self if dr.is_jit_v(mi.Float) else replace(self, entries=self.entries.numpy().tolist())

    def at(self, *x: Any, triangles: bool = False) -> list[Any]:
        """All channels at the coordinates ``x``, one for each axis; beyond [0, 1] the value at the end.

        ``triangles``: cells of the last two axes, of as many nodes, are two triangles on either side of the diagonal,
        where functions that know no order of the two may have a kink; a node less is read.
        """
        if len(x) != len(self.shape):
            raise ParameterError(f"table: {len(x)} coordinates, for {len(self.shape)} axes.")
        first, stride, sides = 0, prod(self.shape), []
        for coordinate, nodes in zip(x, self.shape):
            stride //= nodes
            if nodes > 1:
                node, beyond = _cell(coordinate, nodes)
                first = first + node * stride
                sides.append((stride, beyond))
        corners: list[tuple[Any, Any]] = [(first, 1)]
        if triangles:
            (next_x, x_beyond), (next_y, y_beyond) = sides.pop(-2), sides.pop()
            low, high = dr.minimum(x_beyond, y_beyond), dr.maximum(x_beyond, y_beyond)
            between = first + dr.select(x_beyond > y_beyond, next_x, next_y)
            corners = [(first, 1 - high), (between, high - low), (first + next_x + next_y, low)]
        for stride, beyond in sides:
            corners = [
                (node + offset, weight * share)
                for node, weight in corners
                for offset, share in ((0, 1 - beyond), (stride, beyond))
            ]
        sums: list[Any] = [0] * self.channels
        for node, weight in corners:
            sums = [total + weight * value for total, value in zip(sums, self._values(node))]
        return sums

    def cubic(self, x: Any) -> Any:
        """Hermite's cubic of a table along one axis, whose two channels are a value and its derivative by ``x``."""
        (nodes,) = self.shape
        node, t = _cell(x, nodes)
        (left, rise), (right, fall) = self._values(node), self._values(node + 1)
        step, one = right - left, 1 / (nodes - 1)
        bend, twist = rise * one - step, step - fall * one
        return left + t * (step + (1 - t) * (bend * (1 - t) + twist * t))

    def _values(self, node: Any) -> Any:
        """All channels at the node of this number."""
        if isinstance(self.entries, list):
            return self.entries[node * self.channels : (node + 1) * self.channels]
        shape = (self.channels, dr.width(node))
        return dr.gather(_arrays(type(self.entries)), self.entries, node, shape=shape)


@dataclass
class Made:
    """What is made from constants: anew when they changed, and whenever they carry derivatives, for it to carry them.

    A dataclass, so that ``dr.freeze`` finds the arrays in it.

    Forward derivatives of ``mi.render`` by the only parameter that has some leave out what was made from it (Dr.Jit 1.5
    comes to the picture first); those of an integrator's ``render_forward`` after ``dr.traverse`` do not.
    """

    result: Any = None
    constants: tuple[float, ...] | None = None  # what it was made from; None if they carried derivatives

    def clear(self) -> None:
        """Have nothing."""
        self.result = self.constants = None

    def update(self, make: Callable, *constants: Any) -> None:
        """Let ``result`` be ``make(*constants)``; of numbers, or of Dr.Jit arrays that hold one.

        Raises ParameterError in a frozen function, which would replay this for other numbers; Dr.Jit 1.5 even aborts.
        """
        current = None
        if not dr.grad_enabled(constants):
            current = tuple(float(np.asarray(constant).item()) for constant in constants)
        if current is None or current != self.constants:
            if dr.flag(dr.JitFlag.FreezingScope):
                raise ParameterError(
                    "A table is made from a parameter that changed in a function under dr.freeze: update it outside."
                )
            self.result, self.constants = make(*constants), current


def native(value: Any) -> Any:
    """A table, or an array of one number, for the active variant: in a scalar one of plain floats."""
    if isinstance(value, Table):
        return value.native()
    return value if dr.is_jit_v(mi.Float) else float(dr.detach(value).numpy().item())


def tables_work() -> bool:
    """Whether tables can be made: in scalar variants, too, LLVM computes them."""
    return dr.is_jit_v(mi.Float) or llvm.complaint() is None


def array_types(user: str) -> tuple[Any, Any]:
    """Numbers and vectors to make tables with: the variant's own, or LLVM's where that is scalar.

    Raises LLVMError where that is missing, with ``user``, the parameter that needs it.
    """
    if dr.is_jit_v(mi.Float):
        return mi.Float, mi.Vector3f
    if problem := llvm.complaint():
        raise llvm.LLVMError(f"{user}: is computed by LLVM, in scalar variants too. {problem}")
    import drjit.llvm as backend

    return backend.Float, backend.Array3f


def _cell(x: Any, nodes: int) -> tuple[Any, Any]:
    """Number of the node at or below the coordinate ``x``, the last but one at most, and how far x is to the next."""
    if not dr.is_jit_v(x):
        position = min(max(x, 0), 1) * (nodes - 1)
        node = min(int(position), nodes - 2) if position == position else 0
        return node, position - node
    Float, position = type(x), clamp(x, 0, 1) * (nodes - 1)
    node = dr.minimum(dr.uint32_array_t(Float)(position), nodes - 2)
    return node, position - Float(node)


def _arrays(Float: Any) -> Any:
    """The type of several arrays of the type ``Float``."""
    return dr.replace_shape_t(Float, (-1, -1))
