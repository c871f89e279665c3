"""docs/migration.md: each line of another package and ours give the same integral."""

import importlib.util
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

PAGE = (Path(__file__).parents[1] / "docs" / "migration.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
COMMON = BLOCKS[0]
PAIRS = [(old, new) for old, new in pairwise(BLOCKS) if old.startswith("# before") and new.startswith("# after")]
#: Packages that the page shows; those that are not installed are left out.
PACKAGES = ("scipy", "vegas", "qmcpy", "torch", "torchquad")


def test_every_program_of_the_page_is_one_of_a_pair():
    assert len(BLOCKS) == 1 + 2 * len(PAIRS)
    assert len(PAIRS) >= 8


@pytest.mark.parametrize("pair", range(len(PAIRS)))
def test_old_and_new_line_agree(pair):
    old, new = PAIRS[pair]
    missing = [p for p in PACKAGES if f"import {p}\n" in old + new and importlib.util.find_spec(p) is None]
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")
    np.random.seed(1)  # noqa: NPY002 (vegas takes no other seed)
    names: dict[str, object] = {"__name__": "page"}
    exec(COMMON + old, names)
    exec(COMMON + new, names)
    before, after = names["old"], names["new"]
    before = getattr(before, "integral", before)  # of SciPy
    before = before.mean if hasattr(before, "sdev") else before  # of vegas
    assert abs(float(before) - float(after.integral)) < 2e-3 * abs(float(after.integral))
    assert 0 < float(after.standard_error) < 2e-3 * abs(float(after.integral))
