// voroquad/parallel.hpp: one loop over independent work on a few threads.
//
// With VOROQUAD_NO_THREADS defined, or without exceptions (-fno-exceptions), all loops run on the
// calling thread and no header of threads is included: for targets such as WebAssembly.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include <voroquad/detail/function_ref.hpp>
#include <voroquad/detail/instruction_set.hpp>

#if VOROQUAD_THREADS
#include <voroquad/detail/crew.hpp>
#endif

namespace VOROQUAD {

// The number of threads a call may use: the environment variable
// VOROQUAD_NUM_THREADS where it is a positive number, else one per processor.
//
// Contract: none; the result is at least 1.
inline unsigned default_thread_count() {
    if (const char *text = std::getenv("VOROQUAD_NUM_THREADS"))
        if (const long wanted = std::strtol(text, nullptr, 10); wanted > 0)
            return static_cast<unsigned>(std::min(wanted, 1024L));
#if VOROQUAD_THREADS
    return detail::processors();
#else
    return 1;
#endif
}

// Nothing to do between chunks.
struct NoPause {
    void operator()() const {}
};

namespace detail {

// parallel_for of any body and pause, which both are called by pointer.
inline void run_chunks(std::size_t n, std::size_t grain, unsigned threads,
                       FunctionRef<std::size_t, std::size_t, unsigned> body, FunctionRef<> pause) {
    grain = std::max<std::size_t>(grain, 1);
#if VOROQUAD_THREADS
    const std::size_t chunks = (n + grain - 1) / grain;
    const auto workers = static_cast<unsigned>(
        std::min<std::size_t>(std::max(1u, threads), std::max<std::size_t>(chunks, 1)));
    if (workers > 1) return run_crew(n, grain, workers, body, pause);
#else
    static_cast<void>(threads);
#endif
    for (std::size_t begin = 0; begin < n; begin += grain) {
        pause();
        body(begin, std::min(begin + grain, n), 0u);
    }
}

} // namespace detail

// Calls body(begin, end, worker) for chunks of at most `grain` indices that partition [0, n).
// Chunks are handed out as threads become free, so results may depend on the index only, never on
// worker < max(1, threads), which is there to pick a scratch space. The calling thread calls
// pause() before each of its chunks; the first exception thrown there or by a body ends the loop
// early and is rethrown here.
//
// Contract: body may be called by several threads at once. A grain or a number of threads of 0
// counts as 1.
template <class Body, class Pause = NoPause>
void parallel_for(std::size_t n, std::size_t grain, unsigned threads, Body &&body,
                  Pause &&pause = {}) {
    detail::run_chunks(n, grain, threads,
                       detail::FunctionRef<std::size_t, std::size_t, unsigned>(body),
                       detail::FunctionRef<>(pause));
}

} // namespace VOROQUAD
