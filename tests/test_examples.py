"""The examples run, and what they print is what they promise."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def lines(name):
    """What an example prints."""
    done = subprocess.run([sys.executable, EXAMPLES / name], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def numbers(line):
    return [float(x) for x in re.findall(r"[-+]?\d+\.\d+(?:e[-+]\d+)?", line)]


def test_weigh_points():
    ((plain,), (weighted,), (exact,)) = map(numbers, lines("weigh_points.py"))
    assert abs(weighted - exact) < abs(plain - exact) / 5


def test_one_integral():
    *rules, result = lines("one_integral.py")
    errors = {line[:33].strip(): abs(numbers(line)[1]) for line in rules}
    assert errors["stratified, cubic fits"] < errors["the same, without bias"] < errors["plain Monte Carlo"]
    assert re.search(r"3\.2474\d+\(\d+\)", result)


@pytest.mark.parametrize("line", [0, 1])
def test_importance_sampling(line):
    estimate, exact = numbers(lines("importance_sampling.py")[line])
    assert abs(estimate - exact) < 1e-3
