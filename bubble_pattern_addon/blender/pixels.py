"""Pixels of images, read by Blender, which knows every format; in its program or its module."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..core.errors import FieldError
from ..core.mesh import Floats


def read_image(name: str, folder: Path) -> Floats:
    """The pixels of the image file `name`, seen from `folder`, or else of the open .blend's image of that
    name: (height, width, channels) from 0 to 1, the bottom row first, as stored in the file.

    Raises FieldError where there is no such image, or it is none.
    """
    path = folder / name
    if not path.is_file():
        known = bpy.data.images.get(name)
        if known is None:
            raise FieldError(f"Image {path} does not exist: check the path, which is seen from the recipe")
        return pixels_of(known, name)
    image = load_image(path)
    try:
        return pixels_of(image, name)
    finally:
        bpy.data.images.remove(image)


def load_image(path: Path) -> bpy.types.Image:
    """The image in a file, taken into the open one. Raises FieldError where it cannot be read."""
    try:
        image = bpy.data.images.load(str(path.resolve()), check_existing=False)
    except RuntimeError as error:
        reason = " ".join(str(error).removeprefix("Error: ").split())
        raise FieldError(f"Image {path} can't be read ({reason}): save it as PNG") from None
    image.alpha_mode = 'CHANNEL_PACKED'  # colours as they are, not multiplied by alpha
    return image


def pixels_of(image: bpy.types.Image, name: str = "") -> Floats:
    """The pixels of an image of the open file, as read_image gives them; `name`: what messages call it.

    Raises FieldError where it has none.
    """
    width, height = image.size
    if not width * height:
        raise FieldError(f'Image "{name or image.name}" has no pixels that Blender can read: save it as PNG')
    values = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, image.channels).astype(np.float64)
