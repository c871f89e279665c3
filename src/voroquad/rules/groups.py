"""Samples by group, padded to equal numbers, so that all groups are computed together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import _core
from .._support.arrays import Array, Indices


@dataclass(frozen=True)
class Groups:
    """The samples of each group.

    Attributes
    ----------
    members : ndarray, (groups, size)
        Their numbers; those of a group with fewer than others are followed by any.
    real : ndarray, (groups, size)
        1 for members, 0 for what follows them.
    """

    members: Indices
    real: Array

    @classmethod
    def of(cls, group: Indices, count: int) -> Groups:
        """From the group (n,) of each sample, 0 to count − 1.

        Examples
        --------
        >>> import numpy as np
        >>> from voroquad.rules.groups import Groups
        >>> groups = Groups.of(np.array([0, 1, 0]), 2)
        >>> groups.members[0], groups.real
        (array([0, 2]), array([[1., 1.],
               [1., 0.]]))
        """
        member = group == np.arange(count)[:, None]
        size = member.sum(axis=1).max(initial=0)
        first = np.argsort(~member, axis=1, kind="stable")[:, :size]
        return cls(first, np.take_along_axis(member, first, axis=1).astype(np.float64))

    @cached_property
    def of_each(self) -> Indices:
        """The group (n,) of each sample."""
        real = self.real > 0
        group = np.empty(np.count_nonzero(real), dtype=np.intp)
        group[self.members[real]] = np.nonzero(real)[0]
        return group

    @cached_property
    def in_core(self) -> _core.SampleGroups:
        """What the core is to know of them."""
        return _core.SampleGroups(self.of_each, len(self.members), np.ones(len(self.of_each)))
