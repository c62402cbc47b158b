// SPDX-License-Identifier: GPL-3.0-or-later
// What a caller compares with its own header before other calls: the library's version and the sizes of its structures.
#include "base/version.h"
#include "patina/patina.h"

#include <string.h>

// Every structure of the public headers. tests/unit/test_abi.py fails if one is missing.
#define STRUCTURES(X)                                                                                                          \
    X(analysis_desc)                                                                                                           \
    X(array)                                                                                                                   \
    X(builder_desc)                                                                                                            \
    X(camera)                                                                                                                  \
    X(clip)                                                                                                                    \
    X(cloud_desc)                                                                                                              \
    X(cloud_info)                                                                                                              \
    X(cloud_style)                                                                                                             \
    X(contour_desc)                                                                                                            \
    X(cut_desc)                                                                                                                \
    X(device_desc)                                                                                                             \
    X(device_info)                                                                                                             \
    X(distance_desc)                                                                                                           \
    X(drawing_desc)                                                                                                            \
    X(drawing_info)                                                                                                            \
    X(drawing_line)                                                                                                            \
    X(effects)                                                                                                                 \
    X(expected_error)                                                                                                          \
    X(field_desc)                                                                                                              \
    X(field_info)                                                                                                              \
    X(file_attribute)                                                                                                          \
    X(file_info)                                                                                                               \
    X(file_scan)                                                                                                               \
    X(frame_stats)                                                                                                             \
    X(grid_desc)                                                                                                               \
    X(ground_desc)                                                                                                             \
    X(keys_info)                                                                                                               \
    X(light_desc)                                                                                                              \
    X(lines)                                                                                                                   \
    X(mesh_desc)                                                                                                               \
    X(mesh_info)                                                                                                               \
    X(mesh_style)                                                                                                              \
    X(neighbourhoods)                                                                                                          \
    X(outline_desc)                                                                                                            \
    X(page)                                                                                                                    \
    X(pages_desc)                                                                                                              \
    X(pages_info)                                                                                                              \
    X(panorama)                                                                                                                \
    X(part)                                                                                                                    \
    X(pick)                                                                                                                    \
    X(picked)                                                                                                                  \
    X(read)                                                                                                                    \
    X(rows_info)                                                                                                               \
    X(save_desc)                                                                                                               \
    X(scan)                                                                                                                    \
    X(scan_grade)                                                                                                              \
    X(settings)                                                                                                                \
    X(texture_desc)

const char *patina_version(void) { return pt_version; }

size_t patina_struct_size(const char *name)
{
    static const struct {
        const char *name;
        size_t size;
    } structures[] = {
#define X(name) {"patina_" #name, sizeof(patina_##name)},
        STRUCTURES(X)
#undef X
    };
    for (size_t i = 0; name && i < sizeof structures / sizeof *structures; i++)
        if (!strcmp(name, structures[i].name))
            return structures[i].size;
    return 0;
}
