"""The examples run, and what they print is what they promise."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def lines(name, *arguments):
    """What an example prints."""
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    command = [sys.executable, EXAMPLES / name, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
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


@pytest.mark.parametrize(
    ("name", "picture"),
    [
        ("brillouin_zone.py", "k_points.png"),
        ("declustering.py", "grades.png"),
        ("rain_gauges.py", "gauges.png"),
        ("stack_of_spirals.py", "spirals.png"),
    ],
)
def test_cells_weigh_what_was_sampled_unevenly(name, picture, tmp_path):
    ((plain,), (weighted,), (truth,)) = map(numbers, lines(name, "-o", tmp_path))
    assert abs(weighted - truth) < abs(plain - truth) / 5
    assert (tmp_path / picture).stat().st_size > 10_000


def test_particles(tmp_path):
    gas, clustered = map(numbers, lines("particles.py", "-o", tmp_path))
    assert gas[0] == clustered[0] == 1000
    assert clustered[1] > 2 * gas[1]
    assert abs(gas[2] - (2 + 48 / 35 * 3.14159265**2)) < 0.1  # of a Poisson process (Meijering 1953)
    assert (tmp_path / "particles.png").stat().st_size > 10_000


def test_peaks(tmp_path):
    found = [[float(x) for x in re.findall(r"[\d.]+", line)] for line in lines("peaks.py", "-o", tmp_path)]
    (peak, *_, boxes), (ridge, *_, more_boxes) = found
    one = math.prod((math.atan((1 - m) * 100) + math.atan(m * 100)) * 100 for m in (0.3, 0.62))
    assert peak == pytest.approx(one * (math.e - 1) ** 2, rel=0.01)
    assert ridge == pytest.approx((math.sqrt(math.pi) * 0.03 - 0.03**2) * (math.e - 1) ** 2, rel=0.05)
    assert more_boxes > boxes > 0
    assert (tmp_path / "peaks.png").stat().st_size > 10_000
