"""A contact sheet: many pictures on one, each with its name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL import Image

PAPER, INK = (24, 24, 26), (225, 225, 225)


def arranged(pictures: Mapping[str, Path], columns: int = 8, width: int = 256) -> Image.Image:
    """The pictures in their order, row by row, each ``width`` pixels wide, over their names."""
    from PIL import Image, ImageDraw, ImageFont

    columns, caption = min(columns, len(pictures)), width // 8
    shown = {}
    for name, path in pictures.items():
        with Image.open(path) as image:
            height = round(width * image.height / image.width)
            shown[name] = image.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
    height = max(image.height for image in shown.values()) + caption
    whole = Image.new("RGB", (columns * width, -(-len(shown) // columns) * height), PAPER)
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(caption * 0.5)
    for n, (name, image) in enumerate(shown.items()):
        left, top = n % columns * width, n // columns * height
        whole.paste(image, (left, top))
        middle = (left + width / 2, top + height - caption / 2)
        draw.text(middle, name, fill=INK, font=font, anchor="mm")
    return whole
