"""scripts/tables/contracts.py: every public function and constructor of the C++ headers is in the table."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from test_cpp_headers import PUBLIC_NAMES

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from tables.contracts import HEADERS, declarations  # noqa: E402

HEADER = """
namespace VOROQUAD {

// Some points.
class Points {
public:
    // Contract: n ≥ 1.
    explicit Points(std::size_t n) : n_(n) {
        if (n) {
        }
    }
    std::size_t size() const { return n_; }

private:
    Points(int a, int b);
};

namespace detail {

inline double hidden(double x) {
    return x;
}

} // namespace detail

// Their sum.
//
// Contract: x is finite,
// threads ≥ 1.
template <std::size_t D, class Pause = NoPause>
void sum(const double *x, unsigned threads = 1,
         Pause &&pause = {}) {
    work(x);
}

} // namespace VOROQUAD
"""


def test_signatures_and_contracts() -> None:
    function, constructor = declarations(HEADER)
    assert function.name == "sum"
    assert function.signature == "void sum(const double *x, unsigned threads = 1, Pause &&pause = {})"
    assert function.contract == "x is finite, threads ≥ 1."
    assert (constructor.signature, constructor.contract) == ("Points(std::size_t n)", "n ≥ 1.")


def test_a_function_without_a_contract_is_an_error() -> None:
    function, _ = declarations(HEADER.replace("// Contract: x", "// With x"))
    with pytest.raises(ValueError, match=r"void sum.* has no contract"):
        function.contract  # noqa: B018


def test_every_public_function_is_found() -> None:
    names = {one.name for path in HEADERS.glob("*.hpp") for one in declarations(path.read_text(encoding="utf-8"))}
    functions = {name for name in PUBLIC_NAMES.split() if name[0].islower()}
    assert functions <= names
    assert names - functions == {
        "UniformDesign",
        "StratifiedDesign",
        "StrataBlocks",
        "PointView",
        "Bounds",
        "ConvexDomain",
        "PilotRule",
    }
