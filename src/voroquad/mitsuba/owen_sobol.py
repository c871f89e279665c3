"""The sampler plug-in ``owensobol``: Owen-scrambled sequences that pixels share; made anew for each variant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from .._support.checks import one_of, positive_int
from .accumulation import quotient
from .generators import BITS, HALF, KINDS, PairTables, pair_tables, upper_digits
from .properties import read_property
from .scrambles import combine, crossed_scramble, morton, nested_scramble, nested_shuffle_of_fours, of_key

#: The generators that "auto" stands for
DEFAULT_GENERATORS = "sz"
ORDERS = ("morton", "none")
#: Squares of pixels that share a sequence have 2 to the power of this on a side (benchmarks/block_sizes.py)
BLOCK_BITS = 3
#: Salts: hashes of one seed for different purposes must not agree
_OF_BLOCK, _OF_PIXEL, _OF_ORDER, _OF_GROUP = 0x2545F491, 0x51ED270B, 0x1B873593, 0x38495AB5


@dataclass(frozen=True)
class Window:
    """The pixels of a wavefront: some rows of an image.

    Attributes
    ----------
    width, height : int
        Of the whole image; 0 if they are not known.
    first, last : int
        The wavefront has the rows from `first` to before `last`.
    """

    width: int = 0
    height: int = 0
    first: int = 0
    last: int = 0

    @property
    def pixels(self) -> int:
        """Number of pixels of the wavefront."""
        return self.width * (self.last - self.first)


class OwenSobol(mi.Sampler):
    """Owen-scrambled Sobol' sequences; pixels near each other share one (``owensobol``).

    .. pluginparameters::

     * - sample_count
       - |int|
       - Samples per pixel. Any number works; powers of two are best, as only they make nets. (Default: 4)
     * - width, height
       - |int|
       - Size of the image in pixels: of the film's crop window, with the border that wide filters sample. 0: not known;
         then every pixel is scrambled by itself. The plug-ins ``plain`` and ``reweighted`` set them. (Default: 0)
     * - order
       - |string|
       - ``morton``: the pixels of a block take their samples from one sequence, in a random Morton order, so that the
         errors of pixels near each other cancel to the eye. ``none``: each pixel has a scramble of its own. (Default:
         ``morton``)
     * - generators
       - |string|
       - ``joe-kuo``, Sobol' sequences; ``sz``, groups of coordinates over a finite field, each with the points in
         another order: 4 over that of four elements, or 16 over that of sixteen if a pixel has 256 samples or more in a
         round, or in a set of adaptive sampling; ``auto``, what this version recommends: ``sz``. (Default: ``auto``)
     * - seed
       - |int|
       - Changes all numbers, as the seed of a render does. (Default: 0)

    Notes
    -----
    With n samples per pixel and m = ⌈log2 n⌉, sample s of the pixel with Morton code z has the index 2^m π(z) + s in
    the sequence of its block. π permutes the base-4 digits of z, each by one of 24 permutations that a hash of the
    digits above it picks (Ahmed and Wonka 2020). Coordinate d goes through a nested scrambling with one key, a hash of
    d, block and seed. So each pixel has a scrambled net, and the pixels of an aligned square of 2^k by 2^k, k ≤ 3, have
    one net of 4^k times as many points together.

    Owen's scrambling shifts each point within its elementary interval at random. Here the lower half of the first m
    digits of a coordinate depends on the upper half of its partner alone (`generators.crossed`,
    `scrambles.crossed_scramble`): the points of a pixel are evenly spaced in each row and each column of a grid. That
    is a nested scrambling as well: nets stay nets, and each point is uniform.

    Blocks have 8 × 8 pixels, or fewer where there are more than 2^26 samples. With larger blocks the errors look no
    better; if all pixels shared one scramble, the error of an image would vary much more from seed to seed. Coordinates
    from number 256 on (``sz``: 4, or 16) repeat the first ones with the indices in another order, by a random shuffle
    that keeps aligned blocks of indices together. Two coordinates that are drawn at once are a pair.

    References
    ----------
    A. G. M. Ahmed and P. Wonka, "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical
    ordering of pixels", ACM Transactions on Graphics 39 (2020).

    Examples
    --------
    >>> import mitsuba as mi, voroquad.mitsuba
    >>> mi.set_variant("llvm_ad_rgb")
    >>> sampler = mi.load_dict({"type": "owensobol", "sample_count": 4})
    >>> sampler.seed(0, 4)
    >>> sorted((sampler.next_1d() * 4).numpy().astype(int).tolist())
    [0, 1, 2, 3]
    """

    #: Do `Plain` and its kin draw wavelengths within one period, so that all strata tell them apart?
    one_period = True
    #: Are the samples of a pixel in the order of the sequence? Else in one that is traced faster, see `_of_turn`
    consecutive = True

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        positive_int("sample_count", self.sample_count())
        self.order = one_of("order", read_property(props, "order", "morton"), ORDERS)
        self.generators = one_of("generators", read_property(props, "generators", "auto"), (*KINDS, "auto"))
        self._own_seed = read_property(props, "seed", 0)
        width, height = (read_property(props, name, 0) for name in ("width", "height"))
        if width < 0 or height < 0 or (width == 0) != (height == 0):
            raise ValueError(
                f"width and height must be those of the image in pixels, or both 0, got {width} and {height}"
            )
        self._window = Window(width, height, 0, height)
        self._per_wavefront = 0  # samples of a pixel in a wavefront; 0: not told
        self._seed = mi.UInt32(0)
        self._picked: mi.UInt32 | None = None  # pixels of the wavefront; None: those of the window
        self._starts: mi.UInt32 | None = None  # samples of each of them before those of the first wavefront
        self._begun = 0  # samples of each pixel in the wavefronts before this one
        self._kind = DEFAULT_GENERATORS if self.generators == "auto" else self.generators
        self._crossed = 0  # samples whose pairs are crossed; 0: those of a pixel
        self._set_bits = 0  # of the number of such a sample
        self._tables: PairTables | None = None  # until it is seeded
        self._entries = mi.UInt32(0)
        self.dimension = mi.UInt32(0)

    # ------------------------------------------------------------------ what renderers set

    def cover(self, width: int, height: int, rows: range, *, order: str | None = None) -> None:
        """Set the size of the image, and the rows whose pixels the next wavefront samples.

        Parameters
        ----------
        width, height : int
            Size of the image in pixels.
        rows : range
            Consecutive rows of the image.
        order : str, optional
            Another order from now on.
        """
        self._window = Window(width, height, rows.start, rows.stop)
        self.order = self.order if order is None else order
        self._picked = self._starts = None

    def pick(self, pixels: mi.UInt32, starts: mi.UInt32 | None = None) -> None:
        """Set the pixels that the next wavefront samples, of the image that `cover` has described.

        Parameters
        ----------
        pixels : mitsuba.UInt32
            Numbers of pixels of the image, row by row. Each has the samples that it has in the whole image. A pixel may
            come several times, with other samples.
        starts : mitsuba.UInt32, optional
            So many samples of each of them are left out. None may reach beyond the sampler's samples per pixel.

        Raises
        ------
        ValueError
            The size of the image is not known.
        """
        if not self._window.pixels:
            raise ValueError("pick needs the size of the image; call cover(width, height, range(height)) before")
        self._picked, self._starts = pixels, starts

    def cross(self, samples: int) -> None:
        """Have the points of each so many samples of a pixel evenly spaced in rows and columns, not of all together."""
        self._crossed = samples

    def set_sample_count(self, sample_count: int) -> None:
        """Set the samples per pixel."""
        super().set_sample_count(sample_count)
        self._per_wavefront = 0

    def set_samples_per_wavefront(self, samples: int) -> None:
        """Set the samples per pixel of a wavefront, of which there may be several."""
        super().set_samples_per_wavefront(samples)
        self._per_wavefront = samples

    def clone(self) -> OwenSobol:
        """A sampler that draws the same numbers from here on."""
        props = mi.Properties("owensobol")  # the loader's own do not outlive the load
        props["sample_count"] = self.sample_count()
        other = OwenSobol(props)
        if self.wavefront_size() > 0:
            other.seed(0, self.wavefront_size())
        for name, value in vars(self).items():
            setattr(other, name, value)
        other.dimension = mi.UInt32(self.dimension)  # not shared: each counts what it has drawn itself
        return other

    fork = clone

    def seed(self, seed: mi.UInt32, wavefront_size: int = 2**32 - 1) -> None:
        """Begin a wavefront: the samples of a pixel are consecutive, pixels go row by row."""
        super().seed(seed, wavefront_size)
        pixels, lanes = 0 if self._picked is not None else self._window.pixels, self.wavefront_size()
        # Mitsuba seeds a wavefront of 1 after a render, to free memory
        if pixels and lanes % pixels and lanes > 1:
            window = self._window
            raise ValueError(
                f"width={window.width} and height={window.height} are not the size of an image of {lanes} samples; "
                "give that of the film's crop window (with the border that a wide filter samples), or leave both out"
            )
        # Opaque: another seed must not cost a compilation
        seed = dr.opaque(mi.UInt32, seed) if isinstance(seed, int) else mi.UInt32(seed)
        dr.make_opaque(seed)
        self._seed = combine(seed, mi.UInt32(self._own_seed & 0xFFFFFFFF))
        self._begun = 0
        self._begin()

    def advance(self) -> None:
        """Begin the wavefront of the next samples of each pixel."""
        self._begun += self._per_pixel()
        self._begin()

    # ------------------------------------------------------------------ which points of the sequence

    def _per_pixel(self) -> int:
        """Samples of a pixel in this wavefront."""
        if self._picked is not None:
            return max(1, self.wavefront_size() // dr.width(self._picked))
        if self._window.pixels:
            return max(1, self.wavefront_size() // self._window.pixels)
        return self._per_wavefront or self.sample_count()

    def _samples(self) -> tuple[mi.UInt32, mi.UInt32, int]:
        """Pixel and number of each sample of the wavefront, and how many a pixel has in all."""
        per_pixel = self._per_pixel()
        in_all = max(self.sample_count(), per_pixel)
        bits = (in_all - 1).bit_length()
        lane = dr.arange(mi.UInt32, self.wavefront_size())
        pixel = quotient(lane, per_pixel)
        number = self._of_turn(lane - pixel * dr.opaque(mi.UInt32, per_pixel), per_pixel)
        number += dr.opaque(mi.UInt32, self._begun % 2**bits)
        if self._starts is not None:
            number += dr.gather(mi.UInt32, self._starts, pixel)
        if self._picked is not None:
            pixel = dr.gather(mi.UInt32, self._picked, pixel)
        elif self._window.pixels:
            pixel += dr.opaque(mi.UInt32, self._window.first * self._window.width % 2**32)
        return pixel, number, in_all

    def _of_turn(self, turn: mi.UInt32, per_pixel: int) -> mi.UInt32:
        """The number of the sample that a pixel traces in each turn; bits in reverse order if it need not go by turns.

        A processor traces neighbours of the wavefront at once. Consecutive points of a sequence are as far apart as can
        be, so that their rays meet the most objects. Those whose numbers have the same lower bits are nearer.
        """
        bits = per_pixel.bit_length() - 1
        if self.consecutive or per_pixel == 1 or per_pixel != 1 << bits:
            return turn
        return dr.brev(turn) >> dr.opaque(mi.UInt32, BITS - bits)

    def _begin(self) -> None:
        """Set the key of each sample of the wavefront, and its index, whose bits are kept in reverse order."""
        pixel, number, in_all = self._samples()
        bits = (in_all - 1).bit_length()
        # Beyond the samples that were asked for, another sequence begins
        seed = combine(self._seed, dr.opaque(mi.UInt32, self._begun >> bits))
        if self._window.pixels and self.order == "morton":
            place, self._key, place_bits = self._place(pixel, seed, BITS - bits)
            self._reversed, index_bits = dr.brev(place << bits | number), place_bits + bits
        else:
            self._reversed, index_bits = dr.brev(number), bits
            self._key = combine(pixel, seed ^ _OF_PIXEL)
        size = self._crossed or in_all
        self._set_bits = (size - 1).bit_length()
        tables = pair_tables(self._kind, size, index_bits)
        if tables is not self._tables:
            self._tables, self._entries = tables, mi.UInt32(tables.entries)
        self.dimension = mi.UInt32(0)

    def _place(self, pixel: mi.UInt32, seed: mi.UInt32, most_bits: int) -> tuple[mi.UInt32, mi.UInt32, int]:
        """Place of pixels in the random Morton order of their block, the block's key, and the bits of places."""
        row = pixel // self._window.width
        column = pixel - row * self._window.width
        digits = min(BLOCK_BITS, most_bits // 2)
        seed = combine(combine(column >> digits, row >> digits), seed ^ _OF_BLOCK)
        mask = (1 << digits) - 1
        code = morton(column & mask, row & mask)
        return nested_shuffle_of_fours(code, digits, seed ^ _OF_ORDER), seed, 2 * digits

    # ------------------------------------------------------------------ their coordinates

    def next_1d(self, active: Any = True) -> mi.Float:
        """The next coordinate of each sample, in [0, 1)."""
        return self._coordinates(1)[0]

    def next_2d(self, active: Any = True) -> mi.Point2f:
        """The next two coordinates of each sample, in [0, 1)²."""
        return mi.Point2f(self._coordinates(2))

    def _coordinates(self, count: int) -> list[mi.Float]:
        """The next coordinates; two at once are a pair, whose first one has an even number."""
        first = self.dimension + (self.dimension & 1) if count == 2 else self.dimension
        self.dimension = first + count
        words = self._digits(first)
        if count == 2:
            return [self._coordinate(words, first, 0), self._coordinate(words, first + 1, 1)]
        return [self._coordinate(words, first, first & 1)]

    def _digits(self, dimension: mi.UInt32) -> list[mi.UInt32]:
        """Entries of `PairTables` for the pair of a coordinate."""
        assert self._tables is not None
        _, word_count, parts, part_bits, joint = self._tables
        index = self._index_in(dimension // joint)
        pair = (dimension % joint) >> 1
        words = [mi.UInt32(0) for _ in range(word_count)]
        for part in range(parts):
            shift = BITS - part_bits * (part + 1)  # below 0 where the last part has fewer bits
            value = (index >> shift if shift >= 0 else index << -shift) & ((1 << part_bits) - 1)
            for k in range(word_count):
                entry = value + ((pair * word_count + k) * parts + part << part_bits)
                words[k] ^= dr.gather(mi.UInt32, self._entries, entry)
        return words

    def _index_in(self, group: mi.UInt32) -> mi.UInt32:
        """The reversed indices for a group of coordinates: each but the first takes the samples in another order.

        It is a random permutation that maps aligned blocks of 2^m indices to such blocks, for every m.
        """
        shuffled = nested_scramble(self._reversed, of_key(group, self._key ^ _OF_GROUP))
        return dr.select(group == 0, self._reversed, shuffled)

    def _coordinate(self, words: list[mi.UInt32], dimension: mi.UInt32, place: int | mi.UInt32) -> mi.Float:
        """The scrambled coordinate at a place, 0 or 1, in its pair."""
        halves = [(word >> place * HALF) & ((1 << HALF) - 1) for word in words]
        digits = mi.UInt32(0)
        for k, half in enumerate(halves):
            digits |= half << HALF * k
        upper, other = upper_digits(self._set_bits)
        upper -= place * (upper - other)
        scrambled = crossed_scramble(digits, of_key(dimension, self._key), mi.UInt32(upper), self._set_bits)
        return _unit(dr.brev(scrambled))

    # ------------------------------------------------------------------ Mitsuba's bookkeeping

    def schedule_state(self) -> None:
        """Have the state computed with the wavefront's other results."""
        dr.schedule(self.dimension)

    def traverse(self, callback: mi.TraversalCallback) -> None:
        """Show no parameters: there are none to change."""

    def to_string(self) -> str:
        window = self._window
        return (
            f"OwenSobol[sample_count = {self.sample_count()}, width = {window.width}, height = {window.height}, "
            f"order = {self.order}, generators = {self.generators}, seed = {self._own_seed}]"
        )


def _unit(digits: mi.UInt32) -> mi.Float:
    """Numbers in [0, 1) with these binary digits, as many as a float holds."""
    kept = 24 if dr.type_v(mi.Float) == dr.VarType.Float32 else BITS
    return mi.Float(digits >> (BITS - kept)) * 2.0**-kept


mi.register_sampler("owensobol", OwenSobol)
