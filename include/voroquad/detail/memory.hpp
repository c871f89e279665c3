// voroquad/detail/memory.hpp: arrays of a whole set's size.
#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <voroquad/detail/fail.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Fetches ahead what will be read or written; a hint, without effect where a compiler has none.
template <class T>
void prefetch_to_read([[maybe_unused]] const T *address) {
#if defined(__GNUC__) || defined(__clang__)
    __builtin_prefetch(address);
#endif
}
template <class T>
void prefetch_to_write([[maybe_unused]] T *address) {
#if defined(__GNUC__) || defined(__clang__)
    __builtin_prefetch(address, 1);
#endif
}

// Asks for large pages where the system has them: the first access to each small page would cost a
// tenth of the time that a cell takes. For the same reason elements are left uninitialised.
template <class T>
struct LargePages {
    using value_type = T;
    LargePages() = default;
    template <class U>
    LargePages(const LargePages<U> &) {}

    T *allocate(std::size_t n) {
        if (n > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(T) - page)
            VOROQUAD_FAIL(std::bad_array_new_length());
        const std::size_t bytes = size(n);
        void *p = ::operator new(bytes, alignment(bytes));
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        if (bytes >= page) ::madvise(p, bytes, MADV_HUGEPAGE); // a hint: may fail
#endif
        return static_cast<T *>(p);
    }
    void deallocate(T *p, std::size_t n) { ::operator delete(p, alignment(size(n))); }

    template <class U, class... Arguments>
    void construct(U *p, Arguments &&...arguments) {
        if constexpr (sizeof...(Arguments) == 0) ::new (static_cast<void *>(p)) U;
        else ::new (static_cast<void *>(p)) U(std::forward<Arguments>(arguments)...);
    }
    bool operator==(const LargePages &) const { return true; }

private:
    static constexpr std::size_t page = std::size_t{1} << 21;
    // Whole pages from half a page on
    static std::size_t size(std::size_t n) {
        const std::size_t bytes = n * sizeof(T);
        return bytes < page / 2 ? bytes : (bytes + page - 1) / page * page;
    }
    static std::align_val_t alignment(std::size_t bytes) {
        return std::align_val_t{bytes >= page ? page : 64};
    }
};

template <class T>
using LargeArray = std::vector<T, LargePages<T>>;

} // namespace VOROQUAD::detail
