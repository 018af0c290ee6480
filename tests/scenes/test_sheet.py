import numpy as np
from PIL import Image

from asperity.scenes.sheet import INK, arranged


def test_pictures_stand_in_their_order_over_their_names(tmp_path):
    colours = {"red": (200, 0, 0), "green": (0, 200, 0), "blue": (0, 0, 200)}
    for name, colour in colours.items():
        Image.new("RGB", (40, 20), colour).save(tmp_path / f"{name}.png")
    sheet = np.asarray(arranged({name: tmp_path / f"{name}.png" for name in colours}, columns=2, width=160))
    assert sheet.shape == (2 * (80 + 20), 320, 3)
    corners = [(0, 0), (0, 160), (100, 0)]
    for (top, left), colour in zip(corners, colours.values()):
        assert (sheet[top : top + 80, left : left + 160] == colour).all()
        caption = sheet[top + 80 : top + 100, left : left + 160]
        assert np.abs(caption - np.array(INK, dtype=float)).sum(axis=-1).min() < 150, "no name"
