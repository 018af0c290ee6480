"""Surfaces to measure, meshes in files, and whether what was measured is what it should be.

Values are compared by Student's t with a degree of freedom less than there are tiles, since the standard error itself
comes from that few numbers; Sidak's correction keeps a false alarm in any of n values at 1e-3. The tiles of a mesh are
all the same, so they differ by the noise of the paths alone. Seeds are fixed: what passes once passes always.
"""

import numpy as np
from scipy import stats

from asperity.goniophotometer import HeightField, Hemisphere, measure

TILES = 16
COARSE = Hemisphere(6, 8)
FLAT = np.zeros((3, 5))
WHITE = {"type": "diffuse", "reflectance": 1.0}


def waves(n=48, slope=1.5):
    """Heights of a sum of sines over a period of 1, of that root mean square slope."""
    x, y = np.meshgrid(*[np.arange(n) / n * 2 * np.pi] * 2)
    z = np.sin(2 * x + y) + 0.7 * np.sin(3 * y - x) + 0.5 * np.cos(4 * x)
    return z * slope / np.sqrt(np.square(np.gradient(z, 1 / n)).sum(axis=0).mean())


def write(path, vertices, faces):
    """A mesh in a file, .ply (binary) or .obj."""
    if path.suffix == ".obj":
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
        path.write_text("\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)]) + "\n")
        return path
    corner = [("n", "u1"), ("v", "<i4", 3)]
    head = f"""ply
format binary_little_endian 1.0
element vertex {len(vertices)}
property float x
property float y
property float z
element face {len(faces)}
property list uchar int vertex_indices
end_header
"""
    rows = np.array([(3, face) for face in faces], dtype=corner)
    path.write_bytes(head.encode() + np.array(vertices, "<f4").tobytes() + rows.tobytes())
    return path


def mesh_file(path, heights, shift=(0, 0, 0)):
    """The heights as a mesh of unit width and depth, in a file."""
    shape = HeightField(heights, 1 / (np.array(heights.shape[::-1]) - 1), periodic="mirror").triangles
    return write(path, shape.vertices + shift, shape.faces)


def closed(heights):
    """With the first row and column once more at the end."""
    return np.pad(heights, (0, 1), mode="wrap")


def run(geometry, *incident, paths=2**15, sensor=COARSE, **how):
    return measure(geometry, incident or [(50, 20)], paths=paths, tiles=TILES, sensor=sensor, **how)


def agrees(value, expected, error):
    """Whether all of the values are within their errors; one that never varied must be right to float32."""
    limit = stats.t.ppf(1 - (1 - (1 - 1e-3) ** (1 / np.size(value))) / 2, TILES - 1)
    return np.all(np.abs(value - expected) <= limit * error + 1e-6)
