import numpy as np
import pytest

from asperity.arrays import Directions, mapped
from asperity.errors import ParameterError


def heights(*vectors):
    """Something of width 2 that tells directions apart."""
    return np.stack([vectors[0][:, 2], vectors[-1][:, 0]], axis=1)


def test_angles_and_vectors_are_the_same_directions():
    angles = np.array([[0, 0], [60, 90], [90, 180], [180, 0]])
    vectors = [[0, 0, 1], [0, 0.75**0.5, 0.5], [-1, 0, 0], [0, 0, -1]]
    for given in (angles, vectors):
        assert Directions("wi", given).at((4,), (slice(0, 4),)) == pytest.approx(np.array(vectors), abs=1e-15)


@pytest.mark.parametrize("wi, wo, shape", [((2,), (3,), ()), ((2,), (5, 3), (5,)), ((4, 1, 3), (5, 2), (4, 5)),
                                           ((3, 0, 2), (2,), (3, 0))])  # fmt: skip
def test_broadcasting(wi, wo, shape):
    up = {2: [0, 0], 3: [0, 0, 1]}
    found = mapped(
        heights, [Directions(name, np.broadcast_to(up[s[-1]], s)) for name, s in (("wi", wi), ("wo", wo))], 2
    )
    assert found.shape == (*shape, 2) and np.all(found == [1, 0])


@pytest.mark.parametrize("shape", [(50,), (5, 1, 10), (1,), ()])
@pytest.mark.parametrize("chunk", [1, 7, 50])
def test_pieces_make_the_whole(shape, chunk):
    theta = np.random.default_rng(0).uniform(0, 90, shape)
    wi = Directions("wi", np.stack([theta, 3 * theta], axis=-1))
    assert np.array_equal(mapped(heights, [wi], 2, chunk=chunk), mapped(heights, [wi], 2))


def test_files_larger_than_the_memory_would_do(tmp_path):
    """What is read and written at a time is a chunk: here, of a file."""
    wi = np.memmap(tmp_path / "wi", np.float32, "w+", shape=(1000, 2))
    wi[:, 0] = np.linspace(0, 90, 1000)
    out, sizes = np.memmap(tmp_path / "out", np.float32, "w+", shape=(1000, 2)), []

    def function(i):
        sizes.append(len(i))
        return heights(i)

    assert mapped(function, [Directions("wi", wi)], 2, out, chunk=300) is out
    assert sizes == [300, 300, 300, 100]
    # In float32, θ is known to 4e-6 degrees.
    assert out[:, 0] == pytest.approx(np.cos(np.radians(np.linspace(0, 90, 1000))), abs=2e-7)


BAD = [
    ([1, 2, 3, 4], r"wi has the shape \(4,\): expected \(..., 3\), unit vectors, or \(..., 2\), angles"),
    (5, r"wi has the shape \(\)"),
    ("up", "wi: expected an array of numbers"),
    ([[0, 0], [0, 0, 1]], "wi: expected an array of numbers"),
    ([0, np.nan], r"wi\[0\] = \(0, nan\): expected θ within \[0, 180\] degrees, and a finite φ"),
    ([[0, 0], [-1, 0]], r"wi\[1\] = \(-1, 0\): expected θ"),
    ([[[0, 0], [181, 0]]], r"wi\[0, 1\] = \(181, 0\): expected θ"),
    ([[0, 0, 1], [0, 1, 1]], r"wi\[1\] = \(0, 1, 1\): expected a vector of length 1"),
    ([0, 0, np.inf], "expected a vector of length 1"),
    ([0, 0, np.nan], "expected a vector of length 1"),
]


@pytest.mark.parametrize("given, message", BAD)
def test_bad_directions(given, message):
    with pytest.raises(ParameterError, match=message):
        mapped(heights, [Directions("wi", given)], 2)


@pytest.mark.parametrize("theta", [9, 91])
def test_directions_out_of_range(theta):
    message = rf"wi\[0\] = \({theta}, 0\): expected θ within \[10, 90\] degrees, for a reason"
    with pytest.raises(ParameterError, match=message):
        mapped(heights, [Directions("wi", [theta, 0], 10, 90, ", for a reason")], 2)


def test_the_horizon_is_above():
    """With what float32 makes of it."""
    assert mapped(heights, [Directions("wi", [[1, 0, -1e-7], [1, 0, 0]], high=90)], 2).shape == (2, 2)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"out": np.empty((3, 3))}, r"out has the shape \(3, 3\): expected \(4, 2\)"),
        ({"chunk": 0}, "chunk = 0: expected a whole number, at least 1"),
        ({"chunk": 1.5}, "chunk = 1.5"),
    ],
)
def test_bad_options(options, message):
    with pytest.raises(ParameterError, match=message):
        mapped(heights, [Directions("wi", np.zeros((4, 2)))], 2, **options)


def test_shapes_that_do_not_go_together():
    with pytest.raises(ParameterError, match=r"wi of \(4, 2\) and wo of \(5, 3\): these shapes do not go together"):
        mapped(heights, [Directions("wi", np.zeros((4, 2))), Directions("wo", np.zeros((5, 3)))], 2)
