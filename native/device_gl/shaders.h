// SPDX-License-Identifier: GPL-3.0-or-later
// The shaders as the build embedded them (build/embed_shaders), named relative to shaders/: "kernels/fill.comp".
#ifndef PT_SHADERS_H
#define PT_SHADERS_H

struct pt_embedded_shader {
    const char *name, *text;
};

extern const struct pt_embedded_shader pt_embedded_shaders[]; // ends with {NULL, NULL}

// BIND_* and UNIT_* of each program, by build/generate_kernels of kernels.def; ends with {NULL, NULL}.
extern const struct pt_embedded_shader pt_shader_bindings[];

#endif
