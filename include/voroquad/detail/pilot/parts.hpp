// voroquad/detail/pilot/parts.hpp: the cells of a plan in parts, and these in runs.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/pilot/morton.hpp>
#include <voroquad/parallel.hpp>

namespace VOROQUAD::detail {

// Divides the cells of a k^D grid, in Morton's order, into parts of at most so many samples, but
// those of one cell or more. A part is a row of runs, each of which can be looked up by itself:
// it knows where it begins, and how many blocks of each sequence the cells before it take.
template <std::size_t D, std::size_t Sequences>
class Parts {
public:
    using Blocks = std::array<std::uint32_t, Sequences>;

    struct Run {
        std::uint64_t code;               // of its first cell
        std::size_t cells, before, first; // its own; cells and samples of the part before it
        Blocks blocks;
    };

    struct Part {
        std::size_t cells, samples;
    };

    std::size_t size() const { return parts_.size(); }
    const Part &operator[](std::size_t part) const { return parts_[part]; }
    std::span<const Run> runs(std::size_t part) const {
        const std::size_t begin = begins_[part];
        const std::size_t end = part + 1 < begins_.size() ? begins_[part + 1] : runs_.size();
        return {runs_.data() + begin, end - begin};
    }

    // With look(cell), which tells the sequence and the number of samples() of a cell. Stretches of
    // codes are added up by the threads. Then only those are looked at cell by cell in which a part
    // ends.
    template <class Look, class Pause>
    void divide(std::size_t k, std::size_t most, unsigned threads, const Look &look,
                Pause &&pause) {
        const std::uint64_t codes = MortonOrder<D>::codes(k);
        std::vector<Stretch> stretches((codes + codes_of_a_stretch - 1) / codes_of_a_stretch);
        const auto within = [&](std::size_t s) {
            return MortonOrder<D>(k, s * codes_of_a_stretch, (s + 1) * codes_of_a_stretch);
        };
        const auto add_up = [&](std::size_t begin, std::size_t end, unsigned) {
            for (std::size_t s = begin; s < end; ++s)
                for (MortonOrder<D> order = within(s); !order.done(); order.advance())
                    stretches[s].take(look(order.cell()));
        };
        parallel_for(stretches.size(), stretches_of_a_chunk, threads, add_up, pause);
        runs_.clear();
        begins_.assign(1, 0);
        parts_.assign(1, Part{});
        Blocks blocks{};
        for (std::size_t s = 0; s < stretches.size(); ++s) {
            const Stretch &whole = stretches[s];
            if (whole.cells == 0) continue;
            begin_run(s * codes_of_a_stretch, blocks);
            if (parts_.back().samples + whole.samples <= most) {
                grow(whole.cells, whole.samples);
                for (std::size_t q = 0; q < Sequences; ++q) blocks[q] += whole.blocks[q];
                continue;
            }
            for (MortonOrder<D> order = within(s); !order.done(); order.advance()) {
                const auto cell = look(order.cell());
                if (parts_.back().cells > 0 && parts_.back().samples + cell.samples() > most) {
                    if (runs_.back().cells == 0) runs_.pop_back();
                    begins_.push_back(runs_.size());
                    parts_.push_back({});
                    begin_run(order.code(), blocks);
                }
                grow(1, cell.samples());
                ++blocks[cell.sequence];
            }
        }
    }

private:
    // Codes between two stored sums. At this distance the sums take a third of a byte for each
    // code.
    static constexpr std::uint64_t codes_of_a_stretch = 1024;
    static constexpr std::size_t stretches_of_a_chunk = 16;

    struct Stretch {
        std::size_t cells = 0, samples = 0;
        Blocks blocks{};

        template <class Cell>
        void take(const Cell &cell) {
            ++cells;
            samples += cell.samples();
            ++blocks[cell.sequence];
        }
    };

    void begin_run(std::uint64_t code, const Blocks &blocks) {
        runs_.push_back({code, 0, parts_.back().cells, parts_.back().samples, blocks});
    }
    void grow(std::size_t cells, std::size_t samples) {
        runs_.back().cells += cells;
        parts_.back().cells += cells;
        parts_.back().samples += samples;
    }

    std::vector<Run> runs_;
    std::vector<std::size_t> begins_; // of each part, in the runs
    std::vector<Part> parts_;
};

} // namespace VOROQUAD::detail
