"""Image files for a batch run, read by Blender, which knows every format; in its program or its module."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .core.errors import FieldError
from .core.mesh import Floats


def read_image(name: str, folder: Path) -> Floats:
    """The pixels of the image file `name`, seen from `folder`, or else of the open .blend's image of that
    name: (height, width, channels) from 0 to 1, the bottom row first, as stored in the file.

    Raises FieldError where there is no such image, it is none, or this Python has no Blender in it.
    """
    path = folder / name
    try:
        import bpy
    except ImportError as error:
        raise FieldError(
            f'Image "{name}" needs Blender to be read ({error}): run this in Blender, with '
            "`blender -b -P scripts/pattern_batch.py -- ...`"
        ) from None
    if not path.is_file():
        known = bpy.data.images.get(name)
        if known is None:
            raise FieldError(f"Image {path} does not exist: check the path, which is seen from the recipe")
        return _pixels(known, name)
    try:
        image = bpy.data.images.load(str(path.resolve()), check_existing=False)
    except RuntimeError as error:
        reason = " ".join(str(error).removeprefix("Error: ").split())
        raise FieldError(f"Image {path} can't be read ({reason}): save it as PNG") from None
    try:
        # colours as they are, not multiplied by alpha
        image.alpha_mode = 'CHANNEL_PACKED'
        return _pixels(image, name)
    finally:
        bpy.data.images.remove(image)


def _pixels(image: Any, name: str) -> Floats:
    width, height = image.size
    if not width * height:
        raise FieldError(f'Image "{name}" has no pixels that Blender can read: save it as PNG')
    values = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, image.channels).astype(np.float64)
