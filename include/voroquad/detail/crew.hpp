// voroquad/detail/crew.hpp: threads that share the chunks of a loop.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include <voroquad/detail/function_ref.hpp>
#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

inline unsigned processors() { return std::max(1u, std::thread::hardware_concurrency()); }

// parallel_for (parallel.hpp) on two workers or more, of which the calling thread is worker 0.
inline void run_crew(std::size_t n, std::size_t grain, unsigned workers,
                     FunctionRef<std::size_t, std::size_t, unsigned> body, FunctionRef<> pause) {
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

} // namespace VOROQUAD::detail
