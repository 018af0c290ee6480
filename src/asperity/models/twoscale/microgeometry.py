"""Both scales of roughness one by one: the ground truth of the model. Nothing of the model's is used.

`RandomHeights` are the finer roughness of one smooth facet: they follow a power spectrum, and waves that they delay add
up, of any order. `Facets` that each diffract by Harvey and Shack's theory add up by quadrature, in double precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.special import gamma

from ...errors import ParameterError


@dataclass(frozen=True)
class RandomHeights:
    """Gaussian heights over a square, by the power spectrum of K-correlation (Holzschuch and Pacanowski 2017, Eq. 16).

    Lengths are in micrometres. The square repeats, so that its far field has orders and needs no window; no wave is
    longer than its side.

    Parameters
    ----------
    sigma_s : rms height, at least 0
    b : correlation length, above 0
    c : exponent of the spectrum, above 1
    side : of the square: some 20 b at least, or its longest waves are missed
    cells : along a side
    highest : cycles per micrometre; there are no waves above. Light sees those that turn it to real directions
    """

    sigma_s: float
    b: float
    c: float
    side: float
    cells: int = 256
    highest: float = np.inf

    def __post_init__(self) -> None:
        for name, low in (("b", 0), ("c", 1), ("side", 0), ("cells", 1), ("highest", 0)):
            if not getattr(self, name) > low:
                raise ParameterError(f"{name} = {getattr(self, name)}: expected a number above {low}.")
        if not self.sigma_s >= 0:
            raise ParameterError(f"sigma_s = {self.sigma_s}: expected a number of at least 0.")

    @property
    def orders(self) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies along x (cells, 1) and y (1, cells), cycles per micrometre."""
        along = fft.fftfreq(self.cells, self.side / self.cells)
        return along[:, None], along[None, :]

    @property
    def spectrum(self) -> np.ndarray:
        """Power by the area of frequencies, um^4, at the `orders`; its integral is the variance of the heights."""
        x, y = self.orders
        square = x * x + y * y
        power = (self.sigma_s * self.b) ** 2 * (self.c - 1) / (2 * np.pi)
        power = power * (1 + self.b**2 * square) ** (-(self.c + 1) / 2)
        return np.where((square > 0) & (square <= self.highest**2), power, 0)

    @property
    def variance(self) -> float:
        """Of the heights: sigma_s^2, less what is above ``highest`` or not resolved."""
        return float(self.spectrum.sum() / self.side**2)

    def heights(self, rng: np.random.Generator) -> np.ndarray:
        """A surface (cells, cells), in micrometres."""
        noise = fft.fft2(rng.standard_normal((self.cells, self.cells)))
        return fft.ifft2(noise * np.sqrt(self.spectrum)).real * (self.cells / self.side)


def far_field(heights: np.ndarray, wavenumber: float) -> np.ndarray:
    """Share of light of each order that a mirror of these heights sends there, from one direction: they add up to 1.

    ``wavenumber`` is 2 pi (cos_i + cos_o) / lambda: phase by height, in both directions together. As it depends on the
    outgoing direction, only orders of that cos_o are right.
    """
    phase = (heights * wavenumber).astype(np.float32)
    waves = fft.fft2(np.cos(phase) + 1j * np.sin(phase)) / heights.size
    return waves.real**2 + waves.imag**2


@dataclass(frozen=True)
class Facets:
    """Mirrors of the exponential power distribution with the finer roughness; lengths in micrometres.

    Directions and normals are arrays with x, y, z first; directions are above the horizon.
    """

    alpha: float
    p: float
    sigma_s: float
    b: float
    c: float

    def slopes(self, r: np.ndarray) -> np.ndarray:
        """Density of the slope r alpha, over slopes in units of alpha."""
        return self.p / (np.pi * gamma(1 / self.p)) * np.exp(-(r ** (2 * self.p)))

    def normals(self, h: np.ndarray, u: float) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (3, azimuths, tilts) and D(m) dm of an integral over normals with a peak at h, of width 1 / (2 u)."""
        core, width = 0.1, 0.15 / u / self.alpha
        last = EMPTY ** (0.5 / self.p)
        nearest = min(np.hypot(h[0], h[1]) / max(h[2], 1e-9) / self.alpha, last)
        # log(1 + r / core): tails are long. D has a cusp at r = 0, and for large p an edge at r = 1.
        x, by_tilt = panels(
            0, np.log1p(last / core), ((np.log1p(nearest / core), width / (core + nearest)), (np.log1p(1 / core), 0.1))
        )
        r = core * np.expm1(x)
        psi, by_azimuth = panels(0, np.pi, ((0, width / max(nearest, 0.05)), (np.pi, 0.3)))
        psi, by_azimuth = np.concatenate([psi, -psi]) + np.arctan2(h[1], h[0]), np.concatenate([by_azimuth] * 2)
        slope = self.alpha * r
        steepness = np.sqrt(1 + slope**2)
        m = np.stack(np.broadcast_arrays(np.outer(np.cos(psi), slope), np.outer(np.sin(psi), slope), 1.0)) / steepness
        return m, np.outer(by_azimuth, by_tilt * (r + core) * r * self.slopes(r) * steepness)

    def convolution(self, h: np.ndarray, u: float) -> float:
        """Integral of (1 + 4 u^2 (1 - (h.m)^2))^(-(c + 1) / 2) (h.m)^2 D(m) dm, over facets that h is above."""
        m, weight = self.normals(h, u)
        facing = np.maximum(np.tensordot(h, m, 1), 0)
        return float(np.sum(weight * self._spectrum(2 * u, h, m) * facing**2))

    def diffracted(self, i: np.ndarray, o: np.ndarray, wavelength: float, own: bool = False) -> tuple[float, float]:
        """What facets diffract per steradian, without masking: as the paper separates it, and facet by facet.

        Each facet takes R at the angle of incidence theta_d, as the paper does; or with ``own`` at its own.
        """
        half, B = i + o, self.b / wavelength
        cos_d, sin_d = np.linalg.norm(half) / 2, np.linalg.norm(i - o) / 2
        h = half / np.linalg.norm(half)
        m, weight = self.normals(h, B * cos_d)
        facing, seen, lit = (np.maximum(np.tensordot(w, m, 1), 0) for w in (h, o, i))
        k2, R = (4 * np.pi * self.sigma_s * cos_d / wavelength) ** 2, self.propagating(sin_d, wavelength)
        lobe = weight * B**2 * (self.c - 1) / (2 * np.pi) * self._spectrum(2 * B * cos_d, h, m)
        separated = np.sum(lobe * facing**2) * -np.expm1(-k2 * R) / R
        if own:
            grid = np.linspace(0, 1, 65)
            R = np.interp(np.sqrt(1 - np.minimum(lit, 1) ** 2), grid, [self.propagating(s, wavelength) for s in grid])
        by_facet = np.sum(lobe * -np.expm1(-k2 * facing**2 * R) / R * seen * lit) / (i[2] * o[2])
        return float(separated), float(by_facet)

    def _spectrum(self, scale: float, h: np.ndarray, m: np.ndarray) -> np.ndarray:
        """Shape of the power spectrum at ``scale`` |h x m|."""
        cross = (h[1] * m[2] - h[2] * m[1]) ** 2 + (h[2] * m[0] - h[0] * m[2]) ** 2 + (h[0] * m[1] - h[1] * m[0]) ** 2
        return (1 + scale**2 * cross) ** (-(self.c + 1) / 2)

    def propagating(self, sin: float, wavelength: float) -> float:
        """R: share of the power spectrum that turns light of this sine of incidence into the disc of directions."""
        *_, spectrum = self._disc(sin, wavelength)
        return float(spectrum.sum())

    def smooth_albedo(self, sin: float, wavelength: float) -> tuple[float, float]:
        """What a smooth mirror with the finer roughness keeps in the mirror direction, and what it diffracts."""
        x, y, cos_o, spectrum = self._disc(sin, wavelength)
        cos_i = np.sqrt(1 - sin * sin)
        cos2 = ((x - sin) ** 2 + y**2 + (cos_i + cos_o) ** 2) / 4
        grid = np.linspace(0, 1, 129)
        R = np.interp(np.sqrt(np.maximum(1 - cos2, 0)), grid, [self.propagating(s, wavelength) for s in grid])
        k2 = (4 * np.pi * self.sigma_s / wavelength) ** 2
        facing = (cos_i + cos_o) ** 2 / 4 / cos2
        kept = np.exp(-k2 * cos_i**2 * self.propagating(sin, wavelength))
        return float(kept), float(np.sum(spectrum * facing * -np.expm1(-k2 * cos2 * R) / R))

    def _disc(self, sin: float, wavelength: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Nodes in half the disc of directions: (x, y, cosine, power spectrum by area), of light mirrored to (sin, 0).

        Weights are in the spectrum, those of the other half too.
        """
        B = self.b / wavelength
        t, weight = panels(0, 1, ((np.sqrt(max(1 - sin, 0)), 0.1 / B), (0, 0.1)))
        radius = 1 - t * t  # the cosine has a root at the rim
        phi, around = panels(0, np.pi, ((0, 0.1 / B / max(sin, 0.1)),))
        x, y = np.outer(np.cos(phi), radius), np.outer(np.sin(phi), radius)
        shape = (1 + B**2 * ((x - sin) ** 2 + y**2)) ** (-(self.c + 1) / 2)
        spectrum = B**2 * (self.c - 1) / np.pi * shape * np.outer(around, weight * 2 * t * radius)
        return x, y, np.broadcast_to(np.sqrt(1 - radius**2), x.shape), spectrum

    def smith_lambda(self, w: np.ndarray) -> float:
        """Smith's Lambda: projected area of facets turned away from ``w``, by the cosine of w."""
        t = self.alpha * np.hypot(w[0], w[1]) / w[2]
        last = EMPTY ** (0.5 / self.p)
        if t * last <= 1:
            return 0.0
        x, weight = panels(-np.log(t), np.log(last), ((-np.log(t), 0.05), (0, 0.1)))
        r = np.exp(x)
        beyond = np.maximum(t * r, 1)
        away = np.sqrt(beyond**2 - 1) - np.arccos(1 / beyond)
        return float(np.sum(weight * r * 2 * r * self.slopes(r) * away))


EMPTY = 33
"""Beyond slopes of which there are e^-33, there are no facets."""


def panels(low: float, high: float, peaks: tuple[tuple[float, float], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights of intervals that double away from peaks, given as (position, width)."""
    steps = 2.0 ** np.arange(-1, 40)
    ends = np.concatenate([[low, high], *(at + np.r_[0, width * steps, -width * steps] for at, width in peaks)])
    ends = np.unique(np.clip(ends, low, high))
    x, weight = np.polynomial.legendre.leggauss(6)
    half = np.diff(ends)[:, None] / 2
    return (ends[:-1, None] + half * (x + 1)).ravel(), (half * weight).ravel()
