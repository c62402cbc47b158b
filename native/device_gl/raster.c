// SPDX-License-Identifier: GPL-3.0-or-later
// Runs raster: two passes over a mesh's triangles.
#include "device_gl.h"
#include "shared/meshes.h"

enum {
    GROUP = 64,     // triangles a workgroup
    SLICES = 16,    // workgroups that share a large triangle on a GPU
    LONG_RUN = 2048 // workgroups between two looks at cancel
};

int pt_gl_raster(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    static const char *const definitions[] = {"#define PASS 0\n", "#define PASS 1\n"};
    const struct raster_args *args = work->arguments;
    const uint32_t groups = (args->mesh.id_count + GROUP - 1) / GROUP;
    int result = PATINA_OK;
    for (uint32_t pass = 0; pass < 2 && result == PATINA_OK; pass++) {
        result = pt_gl_kernel_program(d, PT_KERNEL_raster, pass, definitions[pass]);
        for (uint32_t done = 0; done < groups && result == PATINA_OK; done += LONG_RUN) {
            d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_raster][pass], 0, done * GROUP);
            result = pt_gl_dispatch(d, PT_KERNEL_raster, pass, groups - done < LONG_RUN ? groups - done : LONG_RUN,
                                    d->base.info.hardware ? SLICES : 1);
        }
    }
    return result;
}
