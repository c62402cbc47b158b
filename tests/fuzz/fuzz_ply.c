// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a PLY file; what opens is read in full, column by column, and in windows: these come to the same.
#include "fuzz.h"

static float *positions_of(const patina_file *file, uint64_t *count)
{
    patina_file_info info = {.struct_size = sizeof info};
    REQUIRE(patina_file_get_info(file, &info) == PATINA_OK);
    *count = info.count;
    float *xyz = malloc((size_t)info.count * 3 * sizeof *xyz + 1);
    REQUIRE(xyz && patina_file_read_positions(file, xyz, (size_t)info.count * 3 * sizeof *xyz) == PATINA_OK);
    return xyz;
}

// Whether all windows come; `whole`: the positions of the file, NULL where it is refused.
static int read_windows(patina_rows *rows, const float *whole, uint64_t count)
{
    patina_file *window;
    uint64_t done = 0, some;
    for (;;) {
        if (patina_rows_next(rows, 7, &window) != PATINA_OK)
            return 0;
        if (!window)
            break;
        float *xyz = positions_of(window, &some);
        REQUIRE(!whole || (done + some <= count && !memcmp(xyz, whole + 3 * done, (size_t)some * 3 * sizeof *xyz)));
        done += some;
        free(xyz);
        patina_file_destroy(window);
    }
    REQUIRE(!whole || done == count);
    return 1;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const int64_t points = fuzz_open_points(data, size);
    static struct fuzz_file place;
    patina_rows *rows = NULL;
    patina_rows_info info = {.struct_size = sizeof info};
    if (!place.path[0])
        place = fuzz_file();
    REQUIRE(!ftruncate(place.descriptor, 0) && pwrite(place.descriptor, data, size, 0) == (ssize_t)size);
    const int opened = patina_rows_open(place.path, NULL, &rows) == PATINA_OK;
    REQUIRE(opened == (rows != NULL) && (points < 0 || opened));
    if (opened)
        REQUIRE(patina_rows_get_info(rows, &info) == PATINA_OK);
    if (opened && !info.whole[0]) {
        patina_file *file = NULL;
        uint64_t count = 0;
        if (points >= 0)
            REQUIRE(patina_file_open_memory(data, size, &file) == PATINA_OK);
        float *whole = file ? positions_of(file, &count) : NULL;
        REQUIRE(read_windows(rows, whole, count) == (points >= 0));
        free(whole);
        patina_file_destroy(file);
    }
    patina_rows_destroy(rows);
    return 0;
}
