// voroquad/memory.hpp: arrays of a whole set's size.
#pragma once

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace voroquad {

// Asks for large pages where the system has them: the first touch of each small page would cost
// a tenth of the time that a cell takes. What is not given a value gets none, for the same reason.
template <class T>
struct LargePages {
    using value_type = T;
    LargePages() = default;
    template <class U>
    LargePages(const LargePages<U> &) {}

    T *allocate(std::size_t n) {
        void *p = ::operator new(n * sizeof(T), alignment(n));
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        if (is_large(n)) ::madvise(p, n * sizeof(T), MADV_HUGEPAGE); // a hint: may fail
#endif
        return static_cast<T *>(p);
    }
    void deallocate(T *p, std::size_t n) { ::operator delete(p, alignment(n)); }

    template <class U, class... Arguments>
    void construct(U *p, Arguments &&...arguments) {
        if constexpr (sizeof...(Arguments) == 0) ::new (static_cast<void *>(p)) U;
        else ::new (static_cast<void *>(p)) U(std::forward<Arguments>(arguments)...);
    }
    bool operator==(const LargePages &) const { return true; }

private:
    static constexpr std::size_t page = std::size_t{1} << 21;
    static bool is_large(std::size_t n) { return n * sizeof(T) >= 2 * page; }
    static std::align_val_t alignment(std::size_t n) {
        return std::align_val_t{is_large(n) ? page : 64};
    }
};

template <class T>
using LargeArray = std::vector<T, LargePages<T>>;

} // namespace voroquad
