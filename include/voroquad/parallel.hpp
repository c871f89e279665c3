// voroquad/parallel.hpp: one loop over independent work on a few threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD {

// The number of threads a call may use: the environment variable
// VOROQUAD_NUM_THREADS where it is a positive number, else one per processor.
//
// Contract: none; the result is at least 1.
inline unsigned default_thread_count() {
    if (const char *text = std::getenv("VOROQUAD_NUM_THREADS"))
        if (const long wanted = std::strtol(text, nullptr, 10); wanted > 0)
            return static_cast<unsigned>(std::min(wanted, 1024L));
    return std::max(1u, std::thread::hardware_concurrency());
}

// Nothing to do between chunks.
struct NoPause {
    void operator()() const {}
};

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
    grain = std::max<std::size_t>(grain, 1);
    const std::size_t chunks = (n + grain - 1) / grain;
    const auto workers = static_cast<unsigned>(
        std::min<std::size_t>(std::max(1u, threads), std::max<std::size_t>(chunks, 1)));
    if (workers == 1) {
        for (std::size_t begin = 0; begin < n; begin += grain) {
            pause();
            body(begin, std::min(begin + grain, n), 0u);
        }
        return;
    }

    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex error_guard;
    auto work = [&](unsigned worker) {
        try {
            for (std::size_t begin; (begin = next.fetch_add(grain)) < n;) {
                if (worker == 0) pause();
                body(begin, std::min(begin + grain, n), worker);
            }
        } catch (...) {
            const std::scoped_lock lock(error_guard);
            if (!error) error = std::current_exception();
            next = n;
        }
    };
    {
        std::vector<std::jthread> crew;
        crew.reserve(workers - 1);
        try {
            for (unsigned worker = 1; worker < workers; ++worker) crew.emplace_back(work, worker);
        } catch (const std::system_error &) { // no more threads to be had: those there are will do
        }
        work(0);
    }
    if (error) std::rethrow_exception(error);
}

} // namespace VOROQUAD
