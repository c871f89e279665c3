// voroquad._core: each part of the core binds itself.
#include <nanobind/nanobind.h>

void bind_cells(nanobind::module_ &m);
void bind_bias(nanobind::module_ &m);
void bind_boundary_control(nanobind::module_ &m);
void bind_local_fit(nanobind::module_ &m);

NB_MODULE(_core, m) {
    bind_cells(m);
    bind_bias(m);
    bind_boundary_control(m);
    bind_local_fit(m);
}
