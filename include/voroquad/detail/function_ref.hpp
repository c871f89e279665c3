// voroquad/detail/function_ref.hpp: a reference to any function with some arguments.
#pragma once

#include <memory>
#include <type_traits>

#include <voroquad/detail/instruction_set.hpp>

namespace VOROQUAD::detail {

// Calls a function by pointer. What takes such a reference is compiled once for all functions,
// instead of once for each. The function outlives this.
template <class... Arguments>
class FunctionRef {
public:
    template <class Function>
        requires(!std::is_same_v<std::remove_cvref_t<Function>, FunctionRef>)
    explicit FunctionRef(Function &function)
        : function_(const_cast<void *>(static_cast<const void *>(std::addressof(function)))),
          call_(&call<Function>) {}

    void operator()(Arguments... arguments) const { call_(function_, arguments...); }

private:
    template <class Function>
    static void call(void *function, Arguments... arguments) {
        (*static_cast<Function *>(function))(arguments...);
    }

    void *function_;
    void (*call_)(void *, Arguments...);
};

} // namespace VOROQUAD::detail
