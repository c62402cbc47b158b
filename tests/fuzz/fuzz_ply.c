// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a PLY file; what opens is read in full, column by column, and in windows: these come to the same.
#include "fuzz.h"

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);

// ---- structure: lines of the header, its numbers and types, and a body that fits or nearly does --------------------------------

static uint32_t next_random(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

// The start of a random line of the header, and its end behind the line break.
static void pick_line(const uint8_t *data, size_t header, unsigned *seed, size_t *start, size_t *end)
{
    size_t at = next_random(seed) % (header ? header : 1);
    while (at > 0 && data[at - 1] != '\n')
        at--;
    *start = at;
    while (at < header && data[at] != '\n')
        at++;
    *end = at < header ? at + 1 : at;
}

// Puts other bytes in place of some. Returns the new size; as it was where there is no room.
static size_t put(uint8_t *data, size_t size, size_t most, size_t at, size_t old, const void *bytes, size_t count)
{
    if (size - old + count > most)
        return size;
    memmove(data + at + count, data + at + old, size - at - old);
    memcpy(data + at, bytes, count);
    return size - old + count;
}

static size_t header_size(const uint8_t *data, size_t size)
{
    static const char end[] = "end_header";
    for (size_t i = 0; i + sizeof end - 1 <= size; i++)
        if (!memcmp(data + i, end, sizeof end - 1))
            return i;
    return size < 4096 ? size : 4096;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed)
{
    static const char *const words[] = {"property float x\n",
                                        "property double z\n",
                                        "property uchar red\n",
                                        "property list uchar int vertex_indices\n",
                                        "property list float double x\n",
                                        "element face 2\n",
                                        "element vertex 7\n",
                                        "element vertex 18446744073709551615\n",
                                        "element scan 3\n",
                                        "property int scan\n",
                                        "comment \xff\n",
                                        "obj_info width 4\n",
                                        "property float scalar_a\n",
                                        "property float f_dc_0\n",
                                        "property float opacity\n",
                                        "property short nx\n",
                                        "format binary_big_endian 1.0\n",
                                        "format binary_little_endian 1.0\n",
                                        "format ascii 1.0\n",
                                        "end_header\n",
                                        "\r\n"};
    static const char *const numbers[] = {
        "0",   "-1", "1", "7", "255", "65536", "4294967295", "4294967296", "9223372036854775807", "18446744073709551616",
        "1e9", "nan"};
    static const char *const types[] = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double", "int64", "list"};
    const size_t header = header_size(data, size);
    size_t start, end;
    if (!size || next_random(&seed) % 2)
        return LLVMFuzzerMutate(data, size, most);
    pick_line(data, header, &seed, &start, &end);
    switch (next_random(&seed) % 5) {
    case 0: { // a line more
        const char *word = words[next_random(&seed) % (sizeof words / sizeof *words)];
        return put(data, size, most, start, 0, word, strlen(word));
    }
    case 1: // a line less
        return put(data, size, most, start, end - start, "", 0);
    case 2: { // another number at its end
        size_t at = end > start ? end - 1 : end;
        const size_t behind = at;
        const char *number = numbers[next_random(&seed) % (sizeof numbers / sizeof *numbers)];
        while (at > start && data[at - 1] != ' ')
            at--;
        return put(data, size, most, at, behind - at, number, strlen(number));
    }
    case 3: { // another type
        const char *type = types[next_random(&seed) % (sizeof types / sizeof *types)];
        size_t at = start, behind;
        while (at < end && data[at] != ' ')
            at++;
        at += at < end;
        for (behind = at; behind < end && data[behind] != ' ';)
            behind++;
        return put(data, size, most, at, behind - at, type, strlen(type));
    }
    default: { // a body that is longer or shorter by some points
        const size_t body = size - header, some = next_random(&seed) % 64;
        if (next_random(&seed) % 2 && body > some)
            return size - some;
        return body > some ? put(data, size, most, size, 0, data + size - some, some) : size;
    }
    }
}

// ---- reading -------------------------------------------------------------------------------------------------------------------

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
