"""A description at pairs of directions, as a function of its free parameters: values, and derivatives by Dr.Jit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .. import loading
from ..lab import evaluate
from ..measured import BRDF
from .free import Free, described

Array = NDArray[np.float64]
STEP = 1e-3
"""Of central differences, for what Mitsuba has no derivatives by: single precision, smooth functions."""
RENAMED = {"int_ior": "eta"}
"""What ``mi.traverse`` calls a parameter of Mitsuba's plugins otherwise; ``ext_ior`` is 1 then."""


class Model:
    """f cosθ_o of a BSDF in the pairs of some data, whose free parameters are a vector of numbers.

    The numbers are those of `Free.unit`, a colour's one after the other, for each channel.
    """

    def __init__(self, description: dict[str, Any], free: list[Free], channels: tuple[str, ...]):
        self.free, self.channels = free, channels
        self.sizes = [len(self.channels) if one.colour else 1 for one in free]
        # All different: of two equal spectra Mitsuba makes one, and the second parameter would be none.
        middle = {
            one.path: np.full(n, float(one.value(0.5 + 1e-3 * k))) for k, (one, n) in enumerate(zip(free, self.sizes))
        }
        self.description = described(description, middle, self.channels)
        self.bsdf = loading.load(self.description)
        self.parameters = mi.traverse(self.bsdf)
        self.keys = [_key(self.parameters, one.path) for one in free]
        self.current: dict[str, Array] = {}

    def split(self, x: Array) -> list[Array]:
        """The numbers of each parameter."""
        return np.split(np.asarray(x, dtype=np.float64), np.cumsum(self.sizes)[:-1])

    def values(self, x: Array) -> dict[str, Array]:
        """The parameters by their paths."""
        return {one.path: one.value(unit) for one, unit in zip(self.free, self.split(x))}

    def __call__(self, x: Array, pairs: Lanes) -> Array:
        """f cosθ_o (channels, n)."""
        self._set(x)
        return self._ordered(self._eval(pairs), pairs)

    def derivatives(self, x: Array, pairs: Lanes) -> tuple[Array, Array]:
        """Values, and their derivatives by each parameter (parameters, channels, n); a colour's channels do not mix.

        All are of one graph and one kernel: what they share is traced and computed once.
        """
        self._set(x)
        units = self.split(x)
        smooth = [k for k, key in enumerate(self.keys) if self._differentiable(key)]
        for k in smooth:
            parameter = self.parameters[self.keys[k]]
            dr.enable_grad(parameter)
            self.parameters[self.keys[k]] = parameter
        self.parameters.update()
        value = self._eval(pairs)
        found: list[Any] = [None] * len(self.free)
        for k in smooth:
            parameter, one = self.parameters[self.keys[k]], self.free[k]
            dr.set_grad(parameter, _opaque(parameter, one.slope(one.value(units[k]))))
            found[k] = dr.forward_to(value, flags=dr.ADFlag.ClearInterior)
            dr.clear_grad(value)
            dr.set_grad(parameter, 0)
        value = dr.detach(value)
        dr.eval(value, found)
        for k in smooth:
            dr.disable_grad(self.parameters[self.keys[k]])
        self.current = {key: old for key, old in self.current.items() if key not in [self.keys[k] for k in smooth]}
        rows = [
            self._difference(x, k, pairs) if one is None else self._ordered(one, pairs) for k, one in enumerate(found)
        ]
        return self._ordered(value, pairs), np.stack(rows)

    def jacobian(self, derivatives: Array) -> Array:
        """By each number (numbers, channels, n): a colour's number of a channel moves that channel only."""
        rows = []
        for one, row in zip(self.free, derivatives):
            rows += [row * (np.arange(len(row)) == k)[:, None] for k in range(len(row))] if one.colour else [row]
        return np.stack(rows)

    def _differentiable(self, key: str) -> bool:
        """Whether Mitsuba has derivatives by a parameter."""
        never = int(mi.ParamFlags.NonDifferentiable)
        return not self.parameters.flags(key) & never and key.endswith(("value", "values"))

    def _difference(self, x: Array, k: int, pairs: Lanes) -> Array:
        """The central difference by a parameter, within its range."""
        one, place = self.free[k], sum(self.sizes[:k]) + np.arange(self.sizes[k])
        ends = []
        for step in (STEP, -STEP):
            moved = np.array(x, dtype=np.float64)
            moved[place] = np.clip(moved[place] + step, one.unit(one.low), one.unit(one.high))
            ends.append((moved[place].mean(), self(moved, pairs)))
        (high, above), (low, below) = ends
        return (above - below) / (high - low)

    def _set(self, x: Array) -> None:
        """Bring the parameters up to date, of which those that are stay untouched: tables may be made of them."""
        for key, value in zip(self.keys, self.values(x).values()):
            if not np.array_equal(self.current.get(key, np.nan), value):
                self.parameters[key] = _opaque(self.parameters[key], value)
                self.current[key] = value
        self.parameters.update()

    def _eval(self, pairs: Lanes) -> Any:
        return mi.unpolarized_spectrum(self.bsdf.eval(mi.BSDFContext(), pairs.si, pairs.wo))

    def _ordered(self, value: Any, pairs: Lanes) -> Array:
        """(channels, n) from lanes of groups of wavelengths."""
        found = evaluate.to_numpy(value, len(pairs))
        groups = -(-len(self.channels) // len(found))
        return (
            found.reshape(len(found), groups, -1).swapaxes(0, 1).reshape(-1, len(pairs) // groups)[: len(self.channels)]
        )


@dataclass(frozen=True)
class Lanes:
    """Pairs of directions on the device, which all numbers share: one group of wavelengths after the other."""

    si: Any
    wo: Any

    @classmethod
    def of(cls, data: BRDF) -> Lanes:
        """Those of some data, opaque: they share compiled kernels with all others."""
        wavelengths = data.wavelengths
        count = dr.size_v(mi.UnpolarizedSpectrum)
        groups = np.zeros((1, 0))
        if wavelengths is not None:
            groups = np.pad(wavelengths, (0, -len(wavelengths) % count), mode="edge").reshape(-1, count)
        wi, wo = (evaluate.vectors(np.tile(w, (len(groups), 1))) for w in (data.wi, data.wo))
        si = evaluate.interaction(wi, len(data) * len(groups))
        if wavelengths is not None:
            si.wavelengths = type(si.wavelengths)(*np.repeat(groups, len(data), axis=0).T.astype(np.float32))
        dr.make_opaque(si, wo)
        return cls(si, wo)

    def __len__(self) -> int:
        return dr.width(self.wo)


def _key(parameters: Any, path: str) -> str:
    """What ``mi.traverse`` calls a parameter of a description."""
    *parents, name = path.split(".")
    names = [path + ".value", path + ".values", path, ".".join([*parents, RENAMED.get(name, name)])]
    return next(key for key in names if key in parameters)


def _opaque(like: Any, value: Array) -> Any:
    """Numbers in the type of a parameter, as a variable of which no constant is compiled."""
    kind = type(like)
    if not dr.is_array_v(kind):
        return kind(value.ravel()[0])
    if dr.size_v(kind) > 0:  # a colour
        return kind(*(dr.opaque(mi.Float, float(x)) for x in np.broadcast_to(value, dr.size_v(kind))))
    if len(value) == 1:
        return kind(dr.opaque(mi.Float, float(value[0])))
    return kind(np.asarray(value, dtype=np.float32))
