// voroquad._core_…: each part of the core binds itself.
#include <nanobind/nanobind.h>

void bind_cells(nanobind::module_ &m);
void bind_bias(nanobind::module_ &m);
void bind_boundary_control(nanobind::module_ &m);
void bind_local_fit(nanobind::module_ &m);
void bind_kriging(nanobind::module_ &m);
void bind_pilot(nanobind::module_ &m);
void bind_legendre_terms(nanobind::module_ &m);

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>

// Whether the processor has a feature that __builtin_cpu_supports() does not know in every
// compiler: its bit in what a leaf of cpuid says in the register ecx.
static bool has(unsigned leaf, unsigned bit) {
    unsigned eax, ebx, ecx, edx;
    return __get_cpuid(leaf, &eax, &ebx, &ecx, &edx) && (ecx & bit);
}
#endif

// The levels of x86-64 that this processor has, the best first, by the names of the modules: every
// feature of a level, since the compiler may use any, and an operating system that saves their
// registers, which the builtin asks for too.
static nanobind::list processor_levels() {
    nanobind::list levels;
#if defined(__x86_64__) && defined(__GNUC__)
    __builtin_cpu_init();
    const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
                    has(0x1, bit_F16C) && has(0x1, bit_MOVBE) && has(0x80000001, bit_LZCNT);
    const bool v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vl");
    if (v3 && v4) levels.append("v4");
    if (v3) levels.append("v3");
#endif
    levels.append("baseline");
    return levels;
}

#define VOROQUAD_BIND(name, m) NB_MODULE(name, m) // expands the name first
VOROQUAD_BIND(VOROQUAD_MODULE, m) {
    m.def("processor_levels", &processor_levels);
    bind_cells(m);
    bind_bias(m);
    bind_boundary_control(m);
    bind_local_fit(m);
    bind_kriging(m);
    bind_pilot(m);
    bind_legendre_terms(m);
}
