// voroquad._core_…: each part of the core binds itself.
#include <nanobind/nanobind.h>

void bind_cells(nanobind::module_ &m);
void bind_bias(nanobind::module_ &m);
void bind_boundary_control(nanobind::module_ &m);
void bind_local_fit(nanobind::module_ &m);
void bind_kriging(nanobind::module_ &m);
void bind_pilot(nanobind::module_ &m);
void bind_legendre_terms(nanobind::module_ &m);
void bind_powers(nanobind::module_ &m);
void bind_regions(nanobind::module_ &m);

#define VOROQUAD_BIND(name, m) NB_MODULE(name, m) // expands the name first
VOROQUAD_BIND(VOROQUAD_MODULE, m) {
    bind_cells(m);
    bind_bias(m);
    bind_boundary_control(m);
    bind_local_fit(m);
    bind_kriging(m);
    bind_pilot(m);
    bind_legendre_terms(m);
    bind_powers(m);
    bind_regions(m);
}
