"""Light in V-cavities, path by path, in double precision: of the model, the distributions are used and nothing else."""

import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
from scipy.stats import qmc

Float, Vector = llvm.Float64, llvm.Array3f64
TOGETHER = 1 << 22
"""Paths at a time."""


def body_light(distribution, n, wi, wo, scale, paths):
    """f of light that meets at most two facets, one of them a body, for pairs of directions: NumPy (3, k).

    The expectation over cavities, points where light enters, and directions of diffuse light: ``paths`` points of
    Sobol's sequence, a power of two. Light comes from the lower direction, which few facets see. ``scale`` is Q.
    """
    wi, wo = np.where(wi[2] < wo[2], (wi, wo), (wo, wi))
    few = max(TOGETHER // paths, 1)
    parts = (slice(k, k + few) for k in range(0, wi.shape[1], few))
    return np.concatenate([_body_light(distribution, n, wi[:, k], wo[:, k], scale, paths) for k in parts])


def _body_light(distribution, n, wi, wo, scale, paths):
    u = [Float(np.tile(x, wi.shape[1])) for x in qmc.Sobol(5, seed=0).random(paths).T]
    m = distribution.sample(u[0], u[1])
    share = distribution.density(m) * m.z / distribution.sample_density(m)  # a Gaussian's samples are off by a little
    cavity = Cavity(m)
    i, o = (cavity.seen(Vector(*(Float(np.repeat(x, paths)) for x in w))) for w in (wi, wo))

    start = Vector(u[2] - 0.5, 0, 0)
    to_left, to_right = (cavity.distance(start, -i, llvm.Bool(left)) for left in (True, False))
    left = to_left < to_right
    p = start - dr.minimum(to_left, to_right) * i
    here, there = dr.select(left, cavity.left, cavity.right), dr.select(left, cavity.right, cavity.left)

    def shines(q, normal, w):
        """Light from the body at ``q`` along ``w``, of what came in there."""
        cos = dr.maximum(dr.dot(w, normal), 0)
        return scale * transmittance(cos, n) * cos / dr.pi

    def crosses(d):
        """Whether a ray from p along ``d`` meets the other facet, and where."""
        return ~cavity.leaves(p, d) & (dr.dot(d, there) < 0), p + cavity.distance(p, d, ~left) * d

    def met_again(d):
        """Light from the other facet's body along o, of light from p along ``d``."""
        meets, q = crosses(d)
        value = transmittance(-dr.dot(d, there), n) * shines(q, there, o)
        return dr.select(meets & cavity.leaves(q, o), value, 0)

    entered = transmittance(dr.dot(i, here), n)
    value = (1 - entered) * met_again(mirrored(i, here))
    sin, cos = dr.sincos(2 * dr.pi * u[4])
    along = Vector(here.z, 0, -here.x)
    d = dr.sqrt(u[3]) * (cos * along + Vector(0, sin, 0)) + dr.sqrt(1 - u[3]) * here
    value += entered * scale * transmittance(dr.dot(d, here), n) * met_again(d)
    value += dr.select(cavity.leaves(p, o), entered * shines(p, here, o), 0)
    d = -mirrored(o, there)  # turns into o at the other facet
    meets, q = crosses(d)
    reflected = shines(p, here, d) * (1 - transmittance(dr.dot(o, there), n))
    value += dr.select(meets & cavity.leaves(q, o), entered * reflected, 0)
    return np.array(dr.block_sum(share * value, paths) / dr.block_sum(share, paths)) / wo[2]


class Cavity:
    """Two facets below the opening from (-1/2, 0, 0) to (1/2, 0, 0); their normals."""

    def __init__(self, m):
        tilt = dr.hypot(m.x, m.y)
        self.cos, self.sin = m.x / tilt, m.y / tilt
        self.left, self.right = Vector(tilt, 0, m.z), Vector(-tilt, 0, m.z)

    def seen(self, w):
        """A direction in the cavity's own frame."""
        return Vector(w.x * self.cos + w.y * self.sin, w.y * self.cos - w.x * self.sin, w.z)

    def distance(self, p, d, left):
        """Along ``d`` to the plane of the left facet, or of the right one."""
        half, normal = dr.select(left, 0.5, -0.5), dr.select(left, self.left, self.right)
        facing, height = -dr.dot(d, normal), dr.dot(p + Vector(half, 0, 0), normal)
        return dr.select(facing > 0, dr.maximum(height, 0) / dr.maximum(facing, 1e-300), dr.inf)

    @staticmethod
    def leaves(p, d):
        """Whether a ray passes through the opening; it cannot be in the way of itself, since the cavity is convex."""
        return (d.z > 0) & (dr.abs(p.x - p.z * d.x / dr.maximum(d.z, 1e-300)) <= 0.5)


def mirrored(w, normal):
    """As by the law of reflection; ``w`` points away."""
    return 2 * dr.dot(w, normal) * normal - w


def transmittance(cos, n):
    """1 - F by Fresnel's formulas of either polarisation; 0 from behind."""
    c = dr.maximum(cos, 1e-12)
    inside = dr.sqrt(n * n - 1 + c * c)
    s, p = (c - inside) / (c + inside), (n * n * c - inside) / (n * n * c + inside)
    return dr.select(cos > 0, 1 - (s * s + p * p) / 2, 0)
