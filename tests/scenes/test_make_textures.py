import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.scenes import make_textures


@pytest.mark.usefixtures("rgb")
def test_textures_are_those_the_script_makes():
    textures = {"wood": make_textures.wood(), **make_textures.weave(), "patina": make_textures.patina()} | {
        "lint": make_textures.lint()
    }
    for name, image in textures.items():
        path = make_textures.TEXTURES / f"{name}.png"
        assert path.stat().st_size < 150_000
        difference = np.squeeze(np.array(mi.Bitmap(str(path)))).astype(int) - make_textures.encoded(image)
        # Another FFT rounds differently: by one level, save where wood steps from tone to tone.
        assert np.mean(np.abs(difference) > 1) < 1e-3
