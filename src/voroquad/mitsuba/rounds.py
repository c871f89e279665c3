"""Rendering in rounds: the mean of independent images, an estimate of its error, and the state to resume from.

No Mitsuba here: a round is a `Pass`, whoever rendered it.
"""

from __future__ import annotations

import json
import math
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._support.files import atomic_path
from .accumulation import Pass
from .blend import Floats, Share, of_own_half

#: Raise it when the arrays of a state change their meaning, or a pass its bits
_FORMAT = 5


def round_seed(seed: int, number: int) -> int:
    """The seed of a round: of the first the render's own, of the others independent ones."""
    return seed if number == 0 else int(np.random.SeedSequence((seed, number)).generate_state(1)[0])


def pilot_seed(seed: int, number: int) -> int:
    """The seed of an image of a pilot, independent of those of rounds."""
    return int(np.random.SeedSequence((seed, number), spawn_key=(2,)).generate_state(1)[0])


def first_share(done: Pass, *, blend: bool) -> tuple[Floats, Share]:
    """λ (2, height, width) for the halves of a pass that has none before it, 1 without blend; what it says of λ."""
    if not blend:
        return np.ones((2, *done.size), np.float32), Share(*done.size)
    share = Share(*done.size)
    share.observe_noise(done.pixel_plain, done.pixel_difference, done.pixel_noise)
    return share.halves(), share


def alone(done: Pass, *, blend: bool) -> tuple[Floats, Floats]:
    """The image (height, width, channels) of a single pass, and its λ (height, width)."""
    share, _ = first_share(done, blend=blend)
    return done.blended(share), of_own_half(share)


class Rounds:
    """The mean of rounds, each with the λ that the rounds before it suggest.

    Parameters
    ----------
    shape : tuple of int
        Height, width and channels of the images: colours, then other channels.
    blend : bool
        Choose λ; if false it is 1.

    Notes
    -----
    Round r adds E_r = A_r + λ_r D_r. The first round's λ is that of the other half of a checkerboard of its pixels
    (`Share.halves`), later ones' that of all pixels of the rounds before. So λ_r does not depend on what it
    multiplies, and the E_r have equal means and no correlation: Σ (E_r − Ē)² / (R (R − 1)) estimates the variance of
    their mean Ē without bias, as it would were they independent. Sums are in double precision, round after round.
    """

    def __init__(self, shape: tuple[int, ...], *, blend: bool = True) -> None:
        height, width, channels = shape
        self.blend = blend
        self.count = 0
        self.share = Share(height, width)
        self.colours = np.zeros((height, width, 3))  # Σ E
        self.squares = np.zeros((height, width, 3))  # Σ E²
        self.others = np.zeros((height, width, channels - 3))  # Σ of the channels that have no weights
        self.plain = np.zeros((height, width, 3))  # Σ A of pixels: what the next round's is compared with
        self.lambdas = np.zeros((height, width))  # Σ λ

    def add(self, done: Pass) -> None:
        """Add a round."""
        if self.count == 0:
            share, self.share = first_share(done, blend=self.blend)
        elif self.blend:
            share = np.broadcast_to(self.share.map(), (2, *done.size))
            self.share.observe_deviation(done.pixel_plain, done.pixel_difference, self.plain / self.count)
        else:
            share = np.ones((2, *done.size), np.float32)
        colours = done.blended(share)[..., :3].astype(np.float64)
        self.colours += colours
        self.squares += colours**2
        self.others += done.plain[..., 3:]
        self.lambdas += of_own_half(share)
        self.plain += done.pixel_plain
        self.count += 1

    @property
    def image(self) -> Floats:
        """Means (height, width, channels)."""
        return np.concatenate([self.colours, self.others], -1) / self.count

    @property
    def mean_lambda(self) -> Floats:
        """Mean λ (height, width) over the rounds."""
        return self.lambdas / self.count

    @property
    def variance(self) -> Floats:
        """Estimated variance (height, width, 3) of the mean's colours; it takes two rounds."""
        if self.count < 2:
            raise ValueError(f"the variance needs two rounds or more, got {self.count}")
        with np.errstate(invalid="ignore"):  # of pixels that are not finite
            spread = self.squares - self.colours**2 / self.count
        return np.maximum(spread, 0) / (self.count * (self.count - 1))

    @property
    def finite(self) -> NDArray[np.bool_]:
        """Which pixels (height, width) are finite: those of which a ray brought NaN or infinity are not."""
        return np.asarray(np.isfinite(self.colours).all(-1))

    @property
    def mean(self) -> float:
        """Mean radiance over the finite pixels and the colours; nan if there are none."""
        finite = self.finite
        return float(self.colours[finite].mean()) / self.count if finite.any() else math.nan

    @property
    def error(self) -> float:
        """Standard error of a pixel (root mean square over the finite pixels) over the mean radiance.

        Infinite before the second round; nan where it cannot be told: no pixel is finite, or all are black.
        """
        if self.count < 2:
            return math.inf
        level = abs(self.mean)
        return math.sqrt(float(self.variance[self.finite].mean())) / level if level > 0 else math.nan

    # ------------------------------------------------------------------ the state on disk

    _ARRAYS = ("colours", "squares", "others", "plain", "lambdas")

    def save(self, path: str | os.PathLike[str], key: dict[str, Any]) -> None:
        """Write the state, whole or not at all, with the settings `key` that it belongs to."""
        arrays = {name: getattr(self, name) for name in self._ARRAYS}
        arrays["share_moments"] = self.share.moments
        header = json.dumps({"format": _FORMAT, "count": self.count, "blend": self.blend, "key": key})
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            np.savez(file, header=np.array(header), **arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str], key: dict[str, Any]) -> Rounds:
        """Read what :meth:`save` wrote with the same `key`.

        Raises
        ------
        ValueError
            There is no such file, it is damaged, or it belongs to other settings.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                header = json.loads(str(file["header"]))
                if header["format"] != _FORMAT:
                    raise ValueError(f"it is of format {header['format']}, not {_FORMAT}")
                arrays = {name: file[name] for name in (*cls._ARRAYS, "share_moments")}
            height, width = arrays["lambdas"].shape
            rounds = cls((height, width, 3 + arrays["others"].shape[-1]), blend=header["blend"])
            known, rounds.count = header["key"], int(header["count"])
        except FileNotFoundError:
            raise ValueError(f"there is no {os.fspath(path)!r} to resume from; leave --resume out") from None
        except Exception as error:  # a damaged archive fails in as many ways as zipfile, numpy and json have parts
            raise ValueError(
                f"{os.fspath(path)!r} is no state of a render or is damaged ({error}); leave --resume out to begin anew"
            ) from None
        other = sorted(name for name in known.keys() | key.keys() if known.get(name) != key.get(name))
        if other:
            what = "; ".join(f"{name} is {key.get(name)!r}, was {known.get(name)!r}" for name in other)
            raise ValueError(
                f"{os.fspath(path)!r} belongs to another render ({what}); give the same options, or leave --resume out"
            )
        for name in cls._ARRAYS:
            setattr(rounds, name, arrays[name])
        rounds.share.moments = arrays["share_moments"]
        return rounds
