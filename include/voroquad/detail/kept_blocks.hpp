// voroquad/detail/kept_blocks.hpp: memory of small matrices.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <new>
#include <utility>

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>
#include <voroquad/detail/memory.hpp>

namespace VOROQUAD::detail {

// Blocks of memory that were given back in this thread and wait for the next use. The system would
// take them back, and the first access to each page of a new one costs more than small algebra
// does.
class KeptBlocks {
public:
    // What is kept: blocks of at least and at most so many bytes, and at most so many of them,
    // which makes 24 MiB per thread
    static constexpr std::size_t least = std::size_t{1} << 15, most = std::size_t{1} << 21,
                                 count = 12;

    KeptBlocks() = default;
    KeptBlocks(const KeptBlocks &) = delete;
    KeptBlocks &operator=(const KeptBlocks &) = delete;
    ~KeptBlocks() {
        gone() = true;
        for (const Block &block : blocks_) ::operator delete(block.memory, alignment);
    }

    static void *take(std::size_t bytes) {
        if (bytes > most) return LargePages<std::byte>().allocate(bytes);
        if (bytes >= least && !gone())
            for (Block &block : here().blocks_)
                if (block.bytes == bytes) {
                    block.bytes = 0;
                    return std::exchange(block.memory, nullptr);
                }
        return ::operator new(bytes, alignment);
    }
    static void give_back(void *memory, std::size_t bytes) {
        if (bytes > most)
            return LargePages<std::byte>().deallocate(static_cast<std::byte *>(memory), bytes);
        if (bytes >= least && !gone()) {
            KeptBlocks &kept = here();
            Block &place = kept.place();
            std::swap(memory, place.memory);
            place.bytes = bytes;
        }
        ::operator delete(memory, alignment);
    }

private:
    struct Block {
        void *memory = nullptr;
        std::size_t bytes = 0;
    };
    static constexpr std::align_val_t alignment{64};

    // One that is empty, else each in turn
    Block &place() {
        for (Block &block : blocks_)
            if (!block.memory) return block;
        next_ = (next_ + 1) % count;
        return blocks_[next_];
    }

    // Objects that outlive those of their thread free their memory at once.
    static bool &gone() {
        thread_local bool gone = false;
        return gone;
    }
    static KeptBlocks &here() {
        thread_local KeptBlocks blocks;
        return blocks;
    }

    std::array<Block, count> blocks_;
    std::size_t next_ = 0;
};

// The allocator of arrays that come and go with each call
template <class T>
struct Kept {
    using value_type = T;
    Kept() = default;
    template <class U>
    Kept(const Kept<U> &) {}
    T *allocate(std::size_t n) {
        if (n > std::numeric_limits<std::size_t>::max() / sizeof(T))
            VOROQUAD_FAIL(std::bad_array_new_length());
        return static_cast<T *>(KeptBlocks::take(n * sizeof(T)));
    }
    void deallocate(T *p, std::size_t n) { KeptBlocks::give_back(p, n * sizeof(T)); }
    bool operator==(const Kept &) const { return true; }
};

} // namespace VOROQUAD::detail
