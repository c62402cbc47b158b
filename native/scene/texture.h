// SPDX-License-Identifier: GPL-3.0-or-later
// A texture: an image and its halves, quarters, .., as kernels read them (struct texture_args).
#ifndef PT_TEXTURE_H
#define PT_TEXTURE_H

#include "scene/clouds/cloud.h"
#include "shared/meshes.h"

struct patina_texture {
    struct pt_handle handle;
    struct pt_alive *alive;
    uint32_t format, nearest, wrap; // as in struct texture_args
    uint32_t levels, sizes[3 * PT_TEXTURE_LEVELS];
    uint32_t opaque;  // every texel is, and a place beyond the image too
    uint32_t *texels; // words, or four floats each
    size_t bytes;
};

#endif
