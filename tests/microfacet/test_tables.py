import asperity  # noqa: F401  isort: skip
import os
import subprocess
import sys
from itertools import product

import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.microfacet.tables import Made, Table, array_types

SHAPES = [(5,), (2,), (4, 7), (6, 1), (3, 4, 5), (25, 1, 48)]
EPSILON = 2.0**-24


def table(values, Float=llvm.Float64):
    """Of values (channels, nodes...)."""
    return Table.of(values.shape[1:], [Float(channel.ravel()) for channel in values])


def found(values):
    """What a table returned, (channels, lanes)."""
    return np.stack([np.atleast_1d(np.array(value, dtype=float)) for value in values])


def coordinates(rng, axes, n=5000):
    """Inside, beyond, at the ends, and next to them."""
    x = rng.uniform(-0.2, 1.2, (axes, n))
    ends = [-np.inf, -1, -EPSILON, 0, EPSILON, 1 - EPSILON, 1, 1 + EPSILON, np.inf]
    return np.concatenate([x, np.array(list(product(ends, repeat=axes))).T], axis=1).astype(np.float32)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_nodes_and_what_is_linear_between_them_are_exact(any_variant, shape):
    """To the roundings of float32: those of a coordinate count as often as there are nodes."""
    rng, axes = np.random.default_rng(1), len(shape)
    slopes = rng.uniform(-1, 1, (3,) + (2,) * axes)  # of 1, x, y, x y, ...: three functions linear in each coordinate

    def exact(x):
        x = np.where(np.array(shape)[:, None] > 1, np.clip(x, 0, 1), 0.5)
        return sum(slopes[(..., *p)][:, None] * np.prod(x.T**p, axis=1) for p in np.ndindex((2,) * axes))

    nodes = np.stack(
        [x.ravel() for x in np.meshgrid(*(np.linspace(0, 1, n) if n > 1 else [0.5] for n in shape), indexing="ij")]
    )
    Float, _ = array_types("a test")
    made = table(exact(nodes).reshape(3, *shape), Float).native()
    x = coordinates(rng, axes) if dr.is_jit_v(mi.Float) else coordinates(rng, axes, 300)
    lookup = [nodes.astype(np.float32), x]
    for at in lookup:
        if dr.is_jit_v(mi.Float):
            values = found(made.at(*map(mi.Float, at)))
        else:
            values = np.array([made.at(*map(float, one)) for one in at.T]).T
        np.testing.assert_allclose(values, exact(at), atol=4 * 2**axes * max(shape) * EPSILON)


@pytest.mark.parametrize("levels", [1, 3])
def test_triangles_have_a_kink_on_the_diagonal(any_variant, levels):
    """|x - y| + l x, which four nodes of a cell would round off."""
    Float, _ = array_types("a test")
    level, x, y = np.meshgrid(np.linspace(0, 1, levels), *[np.linspace(0, 1, 5)] * 2, indexing="ij")
    made = table((np.abs(x - y) + level * x)[None], Float).native()
    for at in ((0.0, 0.3, 0.3), (0.5, 0.3, 0.45), (0.8, 0.95, 0.1), (1.0, 1.0, 1.0)):
        value = np.asarray(made.at(*(mi.Float(one) for one in at), triangles=True)[0]).item()
        assert value == pytest.approx(abs(at[1] - at[2]) + (at[0] * at[1] if levels > 1 else 0), abs=1e-6)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_the_values_of_nodes_are_returned_bit_by_bit(rgb, shape):
    """Where the coordinate of a node is a float: at the corners, for as wild values as there are."""
    values = np.random.default_rng(2).choice([1e30, -1e-30, 1, 0, 3e38], (2, *shape)).astype(np.float32)
    corners = np.array(list(product([0, 1], repeat=len(shape))), dtype=np.float32)
    expected = [values[(..., *(int(c) * (n - 1) for c, n in zip(corner, shape)))] for corner in corners]
    np.testing.assert_array_equal(found(table(values, mi.Float).at(*map(mi.Float, corners.T))).T, expected)


def test_a_cubic_is_exact(any_variant):
    """Whose values and derivatives are given at the nodes; beyond them, it is the value at the end."""
    Float, _ = array_types("a test")
    cubic, nodes = np.polynomial.Polynomial([0.3, -1, 2, 1.5]), np.linspace(0, 1, 5)
    made = table(np.stack([cubic(nodes), cubic.deriv()(nodes)]), Float).native()
    for x in (-1.0, 0.0, 0.1, 0.25, 0.7, 0.999, 1.0, 2.0):
        assert np.ravel(made.cubic(mi.Float(x)))[0] == pytest.approx(cubic(np.clip(x, 0, 1)), abs=1e-6)


def test_not_a_number_is_no_address(any_variant):
    Float, _ = array_types("a test")
    made, x = table(np.ones((1, 3, 4)), Float).native(), mi.Float(np.nan)
    assert np.isnan(found(made.at(x, x))).all()


@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_derivatives_are_those_of_differences(shape, forward):
    """By entries and coordinates at once, off the nodes: within a cell, in double precision, good to 1e-6."""
    rng = np.random.default_rng(3)
    values, x = rng.uniform(-1, 1, (2, *shape)), rng.uniform(-0.2, 1.2, (len(shape), 500))
    intervals = np.maximum(np.array(shape)[:, None] - 1, 1)
    x = x[:, (np.abs(x * intervals % 1 - 0.5) < 0.49).all(axis=0)]
    directions = rng.uniform(-1, 1, values.shape), rng.uniform(-1, 1, x.shape)

    def total(by):
        at = [llvm.Float64(one) + llvm.Float64(d) * by for one, d in zip(x, directions[1])]
        channels = [llvm.Float64(v.ravel()) + llvm.Float64(d.ravel()) * by for v, d in zip(values, directions[0])]
        return sum(dr.sum(dr.square(value)) for value in Table.of(shape, channels).at(*at))

    step, by = 1e-5, dr.opaque(llvm.Float64, 0)
    difference = (total(llvm.Float64(step))[0] - total(llvm.Float64(-step))[0]) / (2 * step)
    dr.enable_grad(by)
    result = total(by)
    (dr.forward if forward else dr.backward)(by if forward else result)
    assert dr.grad(result if forward else by)[0] == pytest.approx(difference, rel=1e-6)


def tabled(made):
    """A BSDF whose value is that of the first three channels."""

    class Tabled(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.made, self.m_flags = made, int(mi.BSDFFlags.DiffuseReflection)

        def eval(self, ctx, si, wo, active=True):
            return mi.Color3f(*self.made.at(si.wi.z, wo.z, si.wi.x)[:3])

    mi.register_bsdf("tabled", Tabled)
    return mi.load_dict({"type": "tabled"})


@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
@pytest.mark.parametrize("channels", [3, 4])
def test_derivatives_in_virtual_calls(rgb, forward, channels):
    """Are those of direct ones, by entries and coordinates, of two BSDFs told apart by a pointer."""
    rng = np.random.default_rng(4)
    n, values = 1000, rng.uniform(0, 1, (2, channels, 3, 4, 5)).astype(np.float32)
    numbers = rng.uniform(0, 1, (3, n)).astype(np.float32)
    odd = dr.arange(mi.UInt32, n) % 2 == 1

    def called(virtually):
        by = dr.opaque(mi.Float, 1)
        dr.enable_grad(by)
        tables = [Table.of(v.shape[1:], [mi.Float(c.ravel()) * by for c in v]) for v in values]
        bsdfs = [tabled(one) for one in tables]
        x, y, z = (mi.Float(number) * by for number in numbers)
        si, wo = dr.zeros(mi.SurfaceInteraction3f, n), mi.Vector3f(0, 0, y)
        si.wi = mi.Vector3f(z, 0, x)
        if virtually:
            value = dr.select(odd, *map(mi.BSDFPtr, bsdfs)).eval(mi.BSDFContext(), si, wo)
        else:
            value = dr.select(odd, *(bsdf.eval(mi.BSDFContext(), si, wo) for bsdf in bsdfs))
        value = value.x * value.y + value.z
        if forward:
            dr.forward(by)
            return np.array(dr.grad(value))
        dr.backward(dr.sum(value))
        return dr.grad(by)[0]

    np.testing.assert_allclose(called(True), called(False), rtol=1e-4)
    assert np.abs(called(True)).mean() > 0.01


def test_frozen_functions_follow_the_table(rgb):
    lookup, x = dr.freeze(lambda made, x: made.at(x)), mi.Float(0.25, 0.5, 2)
    for scale in (1, 2, 3):
        values = found(lookup(table(scale * np.array([[0, 1, 4.0], [1, 1, 1]]), mi.Float), x))
        np.testing.assert_allclose(values, scale * np.array([[0.5, 1, 4], [1, 1, 1]]))
    assert lookup.n_recordings == 1


@pytest.mark.parametrize(
    "make, complaint",
    [
        (lambda: table(np.ones((1, 2, 2, 2, 2))), r"\(2, 2, 2, 2\) nodes"),
        (lambda: Table.of((3, 4), [llvm.Float64(np.ones(11))]), r"\(3, 4\) nodes, \[11\] values"),
        (lambda: Table.of((3,), []), "expected one to three axes"),
        (lambda: table(np.ones((1, 3, 4))).at(llvm.Float64(0)), "1 coordinates, for 2 axes"),
    ],
)
def test_clear_errors(rgb, make, complaint):
    with pytest.raises(ParameterError, match=complaint):
        make()


def test_made_anew_if_constants_changed_or_carry_derivatives(rgb):
    made, calls = Made(), []

    def make(*constants):
        calls.append(constants)
        return sum(constants)

    made.update(make, 1.0, mi.Float(2))
    made.update(make, mi.Float(1), 2.0)
    assert len(calls) == 1 and dr.allclose(made.result, 3)
    made.update(make, 1.0, 2.5)
    assert len(calls) == 2 and dr.allclose(made.result, 3.5)
    x = mi.Float(2.5)
    dr.enable_grad(x)
    for _ in range(2):  # derivatives can be taken once
        made.update(make, 1.0, x)
        dr.backward(made.result)
    assert len(calls) == 4 and dr.grad(x)[0] == 2
    made.update(make, 1.0, 2.5)
    assert len(calls) == 5 and not dr.grad_enabled(made.result)


@pytest.mark.parametrize(
    "user", ["array_types('alpha')", "mi.load_dict({'type': 'micrograin', 'scattering': 'multiple'})"]
)
def test_without_llvm_a_scalar_variant_says_so(tmp_path, user):
    """It would end in SIGFPE."""
    imports = "import asperity, mitsuba as mi; from asperity.microfacet.tables import array_types"
    code = f"{imports}; mi.set_variant('scalar_rgb'); {user}"
    environment = os.environ | {"DRJIT_LIBLLVM_PATH": str(tmp_path / "libLLVM.so")}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment)
    assert result.returncode == 1
    last = result.stderr.strip().splitlines()[-1]
    assert "is computed by LLVM, in scalar variants too. Dr.Jit cannot load" in last and "unset it" in last
