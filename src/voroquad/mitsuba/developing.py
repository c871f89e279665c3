"""Images in a film: sums over rays become the channels that the film shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mitsuba as mi
import numpy as np

from .blend import Floats

if TYPE_CHECKING:
    from .tracing import Extra


def has_alpha(film: mi.Film) -> bool:
    """Whether a film has a channel of alpha."""
    return bool(mi.has_flag(film.flags(), mi.FilmFlags.Alpha))


def base_channels(film: mi.Film) -> int:
    """The number of channels before extra ones: red, green, blue, and alpha where the film has it."""
    return 4 if has_alpha(film) else 3


def develop(
    film: mi.Film, image: Floats, extras: Sequence[Extra], own: dict[str, Floats], *, has_colours: bool
) -> mi.TensorXf:
    """Put an image into a film and develop it.

    Parameters
    ----------
    film : mitsuba.Film
        It keeps the image.
    image : ndarray, (height, width, channels)
        Linear red, green and blue, alpha where the film has it, then the extra channels.
    extras : sequence of Extra
        What the extra channels are; colours of further images are shown as the film shows its own.
    own : dict of ndarray, (height, width)
        Further channels by their names.
    has_colours : bool
        If false, the extra channels are all that is returned; the film keeps black colours before them.

    Returns
    -------
    mitsuba.TensorXf, (height, width, channels)
        What the film shows, in the order of `channel_names`.
    """
    base = base_channels(film)
    layers: dict[str, Floats] = {}
    k = 0
    while k < len(extras):
        extra, start = extras[k], base + k
        if extra.image:
            shown = np.array(_filled(film, image[..., start : start + base], {}).develop())
            names = channel_names(film)
            layers |= {f"{extra.image}.{name}": shown[..., c] for c, name in enumerate(names)}
            k += base
        else:
            layers[extra.name] = image[..., start]
            k += 1
    layers |= own
    developed = _filled(film, image[..., :base], layers).develop()
    return developed if has_colours else developed[..., developed.shape[-1] - len(layers) :]


def channel_names(film: mi.Film) -> list[str]:
    """The names of the channels that a film shows."""
    return [field.name for field in film.bitmap(raw=False).struct_()]


def colour_count(film: mi.Film) -> int:
    """The number of channels of a film's colours: 1 if it is grey, else 3. What was in the film is lost."""
    film.prepare([])
    return len([name for name in channel_names(film) if name != "A"])


def _filled(film: mi.Film, colours: Floats, layers: dict[str, Floats]) -> mi.Film:
    """The film with colours (height, width, 3 or 4) and extra channels in it."""
    planes = [colours, np.ones((*colours.shape[:2], 1)), *(layer[..., None] for layer in layers.values())]
    block = mi.ImageBlock(mi.TensorXf(np.concatenate(planes, -1, dtype=np.float32)), offset=film.crop_offset())
    film.prepare(list(layers))
    film.put_block(block)
    return film
