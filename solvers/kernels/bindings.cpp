// The extension module: numpy arrays in, numpy arrays out; no DOLFINx types.
#include <nanobind/nanobind.h>

void bind_coarse(nanobind::module_& module);
void bind_cut(nanobind::module_& module);
void bind_factors(nanobind::module_& module);
void bind_kdop(nanobind::module_& module);
void bind_moments(nanobind::module_& module);
void bind_mortar(nanobind::module_& module);
void bind_surface(nanobind::module_& module);

NB_MODULE(_kernels, module)
{
  bind_coarse(module);
  bind_cut(module);
  bind_factors(module);
  bind_kdop(module);
  bind_moments(module);
  bind_mortar(module);
  bind_surface(module);
}
