"""Light in a V-groove, unfolded: a ray goes straight through a fan of mirror images of the two facets.

In the plane across a groove, angles are from the surface's normal n, positive towards the horizontal direction t, and
a direction of length ``l`` in that plane has the angle psi. The facet that light meets first, L, tilts towards t by
``tilt_l``; the other, R, away from t by ``tilt_r``; grooves have depth 1. The images are numbered in the order in which
a ray meets them: L is 1, the image of R in it is 2, and so on; R itself, which may shade L, is 0.

    Lee et al. 2018              here
    theta_i, theta_o             -psi, minus `exit_angle`: their angles are positive the other way round
    theta_l, theta_r, theta_v    -``tilt_l``, ``tilt_r``, `Groove.aperture`; theta_s of symmetric grooves is the tilt
    f(p)                         offset of a ray from the apex, the line through p that is parallel to the ray
    f_a, f_k                     `reach` of the images 1, k; k_a is an odd image (of L), k_b an even one (of R)
    f_b                          `reach` of 0, and at least 0
    G                            `leaving_share`
    theta_h, theta_d             ``theta`` of `Pair`; cos theta_d = i.h is ``length`` times ``cos_delta``

Equations are theirs, with the clamps that they need.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from ...microfacet.fast import angles, greater, lesser, sincos
from ...microfacet.numerics import clamp, heading


class Groove(NamedTuple):
    """The tilts of a groove's two facets, in (0, pi/2)."""

    tilt_l: Any
    tilt_r: Any

    @property
    def aperture(self) -> Any:
        """Angle between the facets, theta_v."""
        return dr.pi - self.tilt_l - self.tilt_r

    def swapped(self, swap: Any) -> Groove:
        """The same groove, seen from the other side where ``swap``."""
        return Groove(dr.select(swap, self.tilt_r, self.tilt_l), dr.select(swap, self.tilt_l, self.tilt_r))


def meeting_angle(groove: Groove, psi: Any, m: Any) -> Any:
    """x_m, between the ray and the m-th image."""
    return psi + dr.pi / 2 - groove.tilt_l + (m - 1) * groove.aperture


def reach(groove: Groove, psi: Any, m: Any) -> Any:
    """f_m: offset from the apex up to which rays reflect at the m-th image; f_0 bounds the shadow (Eq. 6, 9).

    Zero, like the length seen, where the ray runs away from the image.
    """
    x, odd = meeting_angle(groove, psi, m), m % 2 == 1
    tilt = dr.select(odd, groove.tilt_l, groove.tilt_r)
    return dr.select(x < dr.pi, dr.sin(x) * dr.rcp(dr.sin(tilt)), 0)


def leaving_share(groove: Groove, psi: Any, k: int) -> Any:
    """G_k: share of L's area facing the light from which it leaves after k bounces; they add up to G1 (Eq. 6, 9).

    Rays reflect k times at least up to the least of f_1, ..., f_k. That is the first or the last: images join at their
    rims, under twice a facet's tilt, which is less than pi, so the rims are corners of a convex polygon, around which
    offsets rise, and then fall. Of these rays, those up to f_(k+1) reflect again, and those up to f_b are in shadow.
    """
    f_a, f_k, f_next = (reach(groove, psi, m) for m in (1, k, k + 1))
    f_b = dr.maximum(reach(groove, psi, 0), 0)
    leaves = dr.maximum(dr.minimum(f_a, f_k) - dr.maximum(f_next, f_b), 0)
    return dr.select(f_a > 0, leaves / dr.select(f_a > 0, f_a, 1), 0)


def exit_angle(groove: Groove, psi: Any, k: Any) -> Any:
    """Angle of the direction in which light leaves after k bounces (Eq. 5, 8)."""
    v = groove.aperture
    return dr.select(k % 2 == 1, 2 * groove.tilt_l - psi - (k - 1) * v, psi - dr.pi + k * v)


def bounces(groove: Groove, psi: Any, offset: Any, most: Any) -> Any:
    """Number of bounces of the ray at this offset from the apex, at least 1; ``most`` + 1 stands for more."""

    def reflects(k: Any) -> Any:  # again, after k bounces
        return (k <= most) & (offset <= reach(groove, psi, k + 1)) & (meeting_angle(groove, psi, k + 1) < dr.pi)

    UInt = dr.uint32_array_t(type(psi))
    (k,) = dr.while_loop((UInt(1),), reflects, lambda k: (k + 1,))
    return k


def entrance(groove: Groove, psi: Any, u: Any) -> tuple[Any, Any]:
    """(offset, swap): a ray's offset from the apex, uniform over the opening, and whether the ray meets R first.

    R is L of the mirrored groove, in which the ray's angle is -psi. ``u`` is in [0, 1). With `bounces` and `exit_angle`
    it is what the closed ways of rays, which models draw, are tested against.
    """
    left = dr.cos(psi - groove.tilt_l) / dr.maximum(dr.sin(groove.tilt_l), 1e-6)
    right = dr.cos(psi + groove.tilt_r) / dr.maximum(dr.sin(groove.tilt_r), 1e-6)
    offset = dr.lerp(left, -right, u)
    return dr.abs(offset), offset < 0


def symmetric_way(psi: tuple, tilt: tuple, u: Any, most: Any) -> tuple[Any, Any, tuple]:
    """(swap, k, exit): `entrance`, `bounces` and `exit_angle` of facets of equal tilt, by closed forms (Eq. 4).

    Angles are sines and cosines. Since a circle goes through the rims of all images, a ray at ``offset`` from the apex
    meets it at an angle whose sine is that, if the rims' distance is 1; so k is what it turns by, over the aperture.
    """
    (sin_psi, cos_psi), (sin, cos) = psi, tilt
    offset = dr.lerp(cos_psi * cos + sin_psi * sin, sin_psi * sin - cos_psi * cos, u)
    swap, offset = offset < 0, lesser(dr.abs(offset), 1)
    sin_psi = dr.select(swap, -sin_psi, sin_psi)
    across = dr.sqrt((1 - offset) * (1 + offset))
    size, half_aperture, turn = angles((cos_psi, dr.abs(sin_psi)), (sin, cos), (across, offset))
    through = dr.pi - dr.select(sin_psi < 0, -size, size)
    k = dr.ceil((through - half_aperture - turn) / greater(2 * half_aperture, 1e-6))
    k = greater(lesser(k, type(u)(most) + 1), 1)
    sin_out, cos_out = sincos(clamp(through - 2 * k * half_aperture, -dr.pi / 2, dr.pi / 2))
    odd = k - 2 * dr.floor(k / 2) > 0.5
    return swap, dr.uint32_array_t(type(u))(k), (dr.select(odd, sin_out, -sin_out), cos_out)


@dataclass
class Pair:
    """Two directions in the plane of their half vector h and the normal, with all that their BRDF depends on.

    ``theta`` is half the sum of their angles there, which is h's, ``delta`` half the difference, without its sign.
    """

    cos_azimuth: Any  # of h: the direction t across the grooves that may join the two
    sin_azimuth: Any
    theta: Any
    sin_theta: Any
    cos_theta: Any
    delta: Any
    sin_delta: Any
    cos_delta: Any
    length: Any  # of both directions in that plane, l

    @classmethod
    def of(cls, i: Any, o: Any) -> Pair:
        """The pair of two unit vectors above the surface."""
        h = i + o
        # In the mirror direction the plane is any, and the plane of incidence as good as others.
        x, y = heading(h.x, h.y, heading(i.x - o.x, i.y - o.y))
        flat = h.x * x + h.y * y
        sin, cos, norm = polar(flat, h.z)  # 2 l cos delta
        across = ((i.x - o.x) * x + (i.y - o.y) * y) * cos - (i.z - o.z) * sin
        sin_delta, cos_delta, double = polar(dr.abs(across), norm)  # 2 l
        theta, delta = angles((cos, sin), (cos_delta, sin_delta))
        return cls(x, y, theta, sin, cos, delta, sin_delta, cos_delta, double / 2)


def polar(y: Any, x: Any) -> tuple[Any, Any, Any]:
    """(sine, cosine, length) of the vector (x, y)."""
    square = dr.square(x) + dr.square(y)
    inverse = dr.rsqrt(square)
    return y * inverse, x * inverse, square * inverse
