"""How figures look."""

import numpy as np
import pytest

from asperity.drawing import style


def test_scales():
    """From 0, or four decades below the largest at most; few values, and NaN, do not shift the end."""
    maps = [np.array([np.nan, 0, 1e-9, *np.linspace(0.5, 2, 100)]), np.array([2.0])]
    linear, log = (style.norm(maps, scale) for scale in style.SCALES)
    assert (linear.vmin, linear.vmax, log.vmax) == (0, 2, 2)
    assert log.vmin == pytest.approx(0.5, rel=0.1)
    steep = style.norm([np.logspace(-9, 3, 100)], "log")
    assert (steep.vmin, steep.vmax) == pytest.approx((0.1, 1000))
    dark = style.norm([np.zeros(3)], "log")
    assert 0 < dark.vmin < dark.vmax
    assert style.visible(np.array([0, np.nan, 3]), log) == pytest.approx([log.vmin, np.nan, 3], nan_ok=True)


def test_long_titles_are_wrapped_between_parameters():
    assert style.wrapped("gilded, $\\theta_i$ = 30°") == "gilded, $\\theta_i$ = 30°"
    lines = style.wrapped("gilded, tau_0 = 0.2, beta_x = 0.05, base.alpha = 0.2").splitlines()
    assert len(lines) == 2 and not any(line.rstrip().endswith("=") for line in lines)


def test_a_picture_is_whole_or_not_there(tmp_path, monkeypatch):
    made = style.figure(1, 1)

    def full(path, **options):
        path.write_bytes(b"half")
        raise OSError("No space left on device")

    monkeypatch.setattr(made, "savefig", full)
    with pytest.raises(OSError, match="No space left"):
        style.save(made, tmp_path / "out.png")
    assert list(tmp_path.iterdir()) == []
