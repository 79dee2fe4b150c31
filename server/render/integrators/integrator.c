/* SPDX-License-Identifier: MIT */
#include "render/integrators/integrator.h"

const struct integrator_impl *integrator_impl_by_number(unsigned number)
{
    static const struct integrator_impl *const impls[] = {
        [INTEGRATOR_WHITTED] = &integrator_whitted_impl, [INTEGRATOR_DISTRIBUTED] = &integrator_distributed_impl,
        [INTEGRATOR_RAYCAST] = &integrator_raycast_impl, [INTEGRATOR_AO] = &integrator_ao_impl,
        [INTEGRATOR_PATH] = &integrator_path_impl,
    };
    return number < sizeof(impls) / sizeof(impls[0]) ? impls[number] : NULL;
}
