// voroquad/cells.hpp: Voronoi cells of points in the unit box or torus, one by one.
//
// A cell is what is left of the domain after the half-space nearer to each other point has
// been cut away. Nearest points come first; once every vertex of the cell is closer than half
// the distance to all points not yet seen, none of those can cut it ("security radius") and
// the cell is final. There is no global mesh, and no assumption of general position.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "domain.hpp"
#include "interval.hpp"
#include "parallel.hpp"
#include "points.hpp"
#include "polygon.hpp"
#include "polyhedron.hpp"
#include "simd.hpp"
#include "tree.hpp"

namespace voroquad {

template <int D>
using ConvexCell = std::conditional_t<D == 2, ConvexPolygon, ConvexPolyhedron>;

// Cuts the cells of the sites of a tree, leaf by leaf; holds a thread's scratch space.
template <int D>
class CellCutter {
public:
    // Calls visit(site, cell) for the sites of a leaf of the tree. The cell's coordinates are
    // relative to its site.
    template <class Visit>
    void cut_leaf(const PointTree<D> &tree, Domain domain, std::size_t leaf, Visit &&visit) {
        tree_ = &tree;
        domain_ = domain;
        gather(leaf);
        const std::size_t begin = tree.leaf_begin(leaf), end = tree.leaf_begin(leaf + 1);
        for (std::size_t s = begin; s < end; ++s) {
            cut(s, s - begin);
            visit(s, static_cast<const ConvexCell<D> &>(cell_));
        }
    }

private:
    // Collects the points within reach_ of a leaf's box; the leaf's own come first.
    void gather(std::size_t leaf) {
        box_ = tree_->leaf_box(leaf);
        spacing_ = tree_->spacing_near(leaf);
        reach_ = (D == 2 ? 2.2 : 2.0) * spacing_;
        for (int attempt = 0; attempt < 8; ++attempt, reach_ *= 0.5) {
            candidates_ = 0;
            add_leaf(leaf, box_, {});
            for_each_turn(reach_, [&](const Point<D> &turn, bool home) {
                const Box<D> box = relative(box_, turn);
                tree_->within(box, reach_ * reach_, [&](std::size_t l) {
                    if (!home || l != leaf) add_leaf(l, box, turn);
                });
            });
            if (candidates_ <= most_candidates) break;
        }
    }

    void add_leaf(std::size_t leaf, const Box<D> &box, const Point<D> &turn) {
        const std::size_t begin = tree_->leaf_begin(leaf), end = tree_->leaf_begin(leaf + 1);
        reserve(candidates_ + (end - begin) + lanes);
        const double reach2 = reach_ * reach_;
        std::array<const double *, D> from;
        std::array<double *, D> to, turns;
        for (int a = 0; a < D; ++a) {
            from[a] = tree_->coordinates(a);
            to[a] = candidate_[a].data();
            turns[a] = turn_[a].data();
        }
        for (std::size_t s = begin; s < end; ++s) {
            double distance2 = 0.0;
            for (int a = 0; a < D; ++a) {
                const double c = from[a][s];
                to[a][candidates_] = c;
                turns[a][candidates_] = turn[a];
                const double above = c - box.hi[a], below = box.lo[a] - c;
                const double gap = larger(larger(above, below), 0.0);
                distance2 += gap * gap;
            }
            candidates_ += distance2 <= reach2;
        }
    }

    void reserve(std::size_t n) {
        if (distance2_.size() >= n) return;
        n = std::max<std::size_t>(2 * n, 256);
        for (auto &axis : candidate_) axis.resize(n);
        for (auto &axis : turn_) axis.resize(n);
        for (auto &axis : near_) axis.resize(n + 16);
        distance2_.resize(n);
        chosen_.resize(n);
        nearest_.resize(n);
    }

    // Cuts the cell of a site, the candidate `own`.
    void cut(std::size_t s, std::size_t own) {
        site_ = tree_->site(s);
        Box<D> domain;
        for (int a = 0; a < D; ++a) {
            // On the torus the site's own images leave a box around it
            domain.lo[a] = domain_ == Domain::box ? -site_[a] : -0.5;
            domain.hi[a] = domain_ == Domain::box ? 1.0 - site_[a] : 0.5;
        }
        measure_distances();
        distance2_[own] = std::numeric_limits<double>::infinity();

        // The nearest points, then those still within reach of what is left
        const double near2 = (D == 2 ? 4.0 : 2.2) * spacing_ * spacing_;
        if (!trace(domain, near2)) {
            cell_.reset(domain);
            clip_between(0.0, near2);
        }
        clip_between(near2, reach2());

        // All points within reach_ of the leaf's box have been seen
        double seen = std::numeric_limits<double>::infinity();
        for (int a = 0; a < D; ++a)
            seen = std::min({seen, site_[a] - box_.lo[a], box_.hi[a] - site_[a]});
        seen2_ = (seen + reach_) * (seen + reach_) * (1.0 - 1e-12);
        if (reach2() > seen2_) search_far();
    }

    // The cell of the candidates up to a distance by a faster way than clipping, if there is
    // one. A side of the domain is the bisector of the site and its mirror image.
    bool trace(const Box<D> &domain, double near2) {
        if constexpr (D == 2) {
            const Point<2> images[] = {{2.0 * domain.lo[0], 0.0},
                                       {2.0 * domain.hi[0], 0.0},
                                       {0.0, 2.0 * domain.lo[1]},
                                       {0.0, 2.0 * domain.hi[1]}};
            std::size_t count = 0;
            const auto add = [&](const Point<2> &q) {
                near_[0][count] = q[0];
                near_[1][count] = q[1];
                ++count;
            };
            for (std::size_t block = 0; block < candidates_; block += 64) {
                const std::size_t n = std::min<std::size_t>(candidates_ - block, 64);
                for_each_bit(bits_below(distance2_.data() + block, n, near2),
                             [&](std::size_t i) { add(relative_to_site(block + i)); });
            }
            for (const auto &q : images)
                if (dot<2>(q, q) < near2) add(q);
            if (!cell_.trace(near_[0].data(), near_[1].data(), count)) return false;
            if (cell_.squared_radius() > near2) return false; // closed by nearly parallel lines
            for (const auto &q : images)
                if (const double r2 = dot<2>(q, q); r2 >= near2 && r2 < reach2()) cell_.clip(q);
            return true;
        } else {
            return false;
        }
    }

    Point<D> relative_to_site(std::size_t i) const {
        Point<D> q;
        for (int a = 0; a < D; ++a) q[a] = candidate_[a][i] - site_[a];
        if (domain_ == Domain::torus)
            for (int a = 0; a < D; ++a) q[a] += turn_[a][i];
        return q;
    }

    void measure_distances() {
        const std::size_t n = candidates_;
        double *distance2 = distance2_.data();
        for (int a = 0; a < D; ++a) {
            const double *c = candidate_[a].data(), *t = turn_[a].data();
            const double s = site_[a];
            if (domain_ == Domain::box) {
                if (a == 0)
                    for (std::size_t i = 0; i < n; ++i) distance2[i] = (c[i] - s) * (c[i] - s);
                else
                    for (std::size_t i = 0; i < n; ++i) distance2[i] += (c[i] - s) * (c[i] - s);
            } else {
                for (std::size_t i = 0; i < n; ++i) {
                    const double q = (c[i] - s) + t[i];
                    distance2[i] = (a == 0 ? 0.0 : distance2[i]) + q * q;
                }
            }
        }
    }

    // Clips with the candidates whose squared distance is at least `from` and below `to`,
    // roughly nearest first.
    void clip_between(double from, double to) {
        std::size_t count = 0;
        for (std::size_t block = 0; block < candidates_; block += 64) {
            const double *distance2 = distance2_.data() + block;
            const std::size_t n = std::min<std::size_t>(candidates_ - block, 64);
            for_each_bit(
                bits_below(distance2, n, to) & ~bits_below(distance2, n, from),
                [&](std::size_t i) { chosen_[count++] = static_cast<std::uint32_t>(block + i); });
        }

        // Counting sort into shells, which a processor predicts better than comparisons
        constexpr std::size_t shells = 16;
        std::array<std::uint32_t, shells + 1> start{};
        const double scale = to - from > 1e-290 ? shells * (1.0 - 1e-9) / (to - from) : 0.0;
        const auto shell_of = [&](std::uint32_t i) {
            return static_cast<std::size_t>((distance2_[i] - from) * scale);
        };
        for (std::size_t k = 0; k < count; ++k) ++start[shell_of(chosen_[k]) + 1];
        for (std::size_t k = 0; k < shells; ++k) start[k + 1] += start[k];
        for (std::size_t k = 0; k < count; ++k)
            nearest_[start[shell_of(chosen_[k])]++] = chosen_[k];

        double reach = reach2();
        for (std::size_t k = 0; k < count; ++k) {
            const std::uint32_t i = nearest_[k];
            if (distance2_[i] > reach) continue;
            cell_.clip(relative_to_site(i));
            reach = reach2();
        }
    }

    // Visits the rest of the tree, nearest boxes first, where a point could still cut the cell.
    void search_far() {
        for_each_turn(std::numeric_limits<double>::infinity(), [&](const Point<D> &turn, bool) {
            const Point<D> from = relative({site_, site_}, turn).lo;
            const auto may_cut = [&](const Box<D> &box, double distance2) {
                return distance2 <= reach2() && !seen(box, from) &&
                       cell_.within_reach_of(seen_from_site(box, turn));
            };
            tree_->search({from, from}, may_cut, [&](std::size_t leaf, double) {
                for (std::size_t s = tree_->leaf_begin(leaf); s < tree_->leaf_begin(leaf + 1);
                     ++s) {
                    Point<D> q = tree_->site(s);
                    for (int a = 0; a < D; ++a) q[a] = (q[a] - site_[a]) + turn[a];
                    const double distance2 = dot<D>(q, q);
                    if (distance2 > seen2_ && distance2 <= reach2()) cell_.clip(q);
                }
            });
        });
    }

    // Whether all of a box lies where every point has been seen already
    bool seen(const Box<D> &box, const Point<D> &from) const {
        double farthest2 = 0.0;
        for (int a = 0; a < D; ++a) {
            const double far = larger(from[a] - box.lo[a], box.hi[a] - from[a]);
            farthest2 += far * far;
        }
        return farthest2 < seen2_;
    }

    // Points at least twice the radius away cut nothing; the margin covers rounding.
    double reach2() const { return 4.0 * cell_.squared_radius() * (1.0 + 1e-12); }

    // Calls visit(turn, home) for the images of the domain that may hold points within `reach`
    // of the leaf: itself, and on the torus its neighbours. (An image of a point that is a
    // whole turn away from the site or farther in some direction cuts no more than the site's
    // own image and the image one turn nearer do.)
    template <class Visit>
    void for_each_turn(double reach, Visit &&visit) const {
        std::array<int, D> low{}, high{};
        if (domain_ == Domain::torus)
            for (int a = 0; a < D; ++a) {
                low[a] = box_.lo[a] - reach <= 0.0 ? -1 : 0;
                high[a] = box_.hi[a] + reach >= 1.0 ? 1 : 0;
            }
        for (std::array<int, D> k = low;;) {
            Point<D> turn;
            bool home = true;
            for (int a = 0; a < D; ++a) {
                turn[a] = k[a];
                home &= k[a] == 0;
            }
            visit(turn, home);
            int a = 0;
            for (; a < D && k[a] == high[a]; ++a) k[a] = low[a];
            if (a == D) return;
            ++k[a];
        }
    }

    // A box as the image of the domain that is `turn` away sees it
    static Box<D> relative(Box<D> box, const Point<D> &turn) {
        for (int a = 0; a < D; ++a) box.lo[a] -= turn[a], box.hi[a] -= turn[a];
        return box;
    }
    Box<D> seen_from_site(Box<D> box, const Point<D> &turn) const {
        for (int a = 0; a < D; ++a) {
            box.lo[a] = (box.lo[a] - site_[a]) + turn[a];
            box.hi[a] = (box.hi[a] - site_[a]) + turn[a];
        }
        return box;
    }

    static constexpr std::size_t most_candidates = D == 2 ? 256 : 2048;

    const PointTree<D> *tree_ = nullptr;
    Domain domain_ = Domain::box;
    Box<D> box_{};
    double spacing_ = 0.0, reach_ = 0.0, seen2_ = 0.0;
    std::size_t candidates_ = 0;
    std::array<std::vector<double>, D> candidate_, turn_, near_;
    std::vector<double> distance2_;
    std::vector<std::uint32_t> chosen_, nearest_;
    Point<D> site_{};
    ConvexCell<D> cell_;
};

// Scratch space for one set after another.
template <int D>
struct CellWorkspace {
    PointTree<D> tree;
    std::vector<CellCutter<D>> cutters;
};
template <>
struct CellWorkspace<1> {
    RankedPoints ranked;
};

// Calls visit(site, cell, worker) for every distinct point in parallel, along the tree's curve.
template <int D, class Visit, class Pause = NoPause>
void for_each_cell(CellWorkspace<D> &work, Domain domain, unsigned threads, Visit &&visit,
                   Pause &&pause = {}) {
    if (work.cutters.size() < threads) work.cutters.resize(threads);
    const auto cut_leaves = [&](std::size_t begin, std::size_t end, unsigned worker) {
        for (std::size_t leaf = begin; leaf < end; ++leaf)
            work.cutters[worker].cut_leaf(
                work.tree, domain, leaf,
                [&](std::size_t site, const auto &cell) { visit(site, cell, worker); });
    };
    parallel_for(work.tree.leaves(), 128, threads, cut_leaves, pause);
}

// Lengths, areas or volumes of the cells. Points that coincide share their cell equally.
template <int D, class Pause = NoPause>
void cell_measures(const PointView<D> &points, Domain domain, double *measures,
                   CellWorkspace<D> &work, unsigned threads = 1, Pause &&pause = {}) {
    if constexpr (D == 1) {
        cell_lengths(points, domain, measures, work.ranked);
    } else {
        if (points.size() == 0) return;
        work.tree.build(points);
        const auto share = [&](std::size_t site, const auto &cell, unsigned) {
            const auto here = work.tree.points_at(site);
            const double measure = cell.measure() / static_cast<double>(here.size());
            for (const std::size_t i : here) measures[i] = measure;
        };
        for_each_cell(work, domain, threads, share, pause);
    }
}

// Measures of independent sets of n points of [0,1]^D each; set(s) is the PointView of one.
// In parallel over sets
// where there are enough of them and over cells elsewhere. Every measure depends on its
// own set only: the result is the same to the last bit for any number of threads.
template <int D, class Set, class Pause = NoPause>
void cell_measures_of_sets(Set &&set, std::size_t sets, std::size_t n, Domain domain,
                           double *measures, unsigned threads, Pause &&pause = {}) {
    if (sets >= 2 * std::size_t{threads} || n < 4096) {
        std::vector<CellWorkspace<D>> work(std::max(1u, threads));
        const std::size_t grain = std::max<std::size_t>(1, 1024 / std::max<std::size_t>(n, 1));
        const auto measure_sets = [&](std::size_t begin, std::size_t end, unsigned worker) {
            for (std::size_t s = begin; s < end; ++s)
                cell_measures<D>(set(s), domain, measures + s * n, work[worker]);
        };
        parallel_for(sets, grain, threads, measure_sets, pause);
    } else {
        CellWorkspace<D> work;
        for (std::size_t s = 0; s < sets; ++s)
            cell_measures<D>(set(s), domain, measures + s * n, work, threads, pause);
    }
}

// The cells of a set in the plane as polygons: those of point i are
// vertices[offsets[i]] … vertices[offsets[i+1] - 1], counter-clockwise, in the
// coordinates of the points (on the torus a cell may reach beyond the unit square).
struct Polygons {
    std::vector<Point<2>> vertices;
    std::vector<std::size_t> offsets;
};

inline Polygons cell_polygons(const PointView<2> &points, Domain domain) {
    CellWorkspace<2> work;
    work.tree.build(points);

    // Site after site, without edges of length zero
    std::vector<Point<2>> corners;
    std::vector<std::size_t> begin(work.tree.sites() + 1), site_of(points.size());
    for_each_cell(work, domain, 1, [&](std::size_t s, const ConvexPolygon &cell, unsigned) {
        const Point<2> site = work.tree.site(s);
        for (const std::size_t i : work.tree.points_at(s)) site_of[i] = s;
        begin[s] = corners.size();
        for (std::size_t v = 0; v < cell.size(); ++v) {
            Point<2> corner = cell.vertex(v);
            for (int a = 0; a < 2; ++a) {
                corner[a] += site[a];
                if (domain == Domain::box) corner[a] = std::clamp(corner[a], 0.0, 1.0);
            }
            if (corners.size() == begin[s] || corner != corners.back()) corners.push_back(corner);
        }
        while (corners.size() > begin[s] + 1 && corners.back() == corners[begin[s]])
            corners.pop_back();
    });
    begin.back() = corners.size();

    // Into the caller's order
    Polygons out;
    out.offsets.push_back(0);
    for (const std::size_t s : site_of) {
        out.vertices.insert(out.vertices.end(),
                            corners.begin() + static_cast<std::ptrdiff_t>(begin[s]),
                            corners.begin() + static_cast<std::ptrdiff_t>(begin[s + 1]));
        out.offsets.push_back(out.vertices.size());
    }
    return out;
}

} // namespace voroquad
