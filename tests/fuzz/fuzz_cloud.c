// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: a saved cloud that was damaged. The input is a list of edits to a good file, five bytes each: a section
// (64 KiB, as patina_cloud_save lays them out), an offset, a value and how it is put there: as a byte, or as a number of 4 or 8 bytes
// that is 0, -1, the largest, NaN, infinite or near what was there. Two of three inputs get a right sum of the header again, so that what
// looks behind it sees the edits. The last byte of an odd list cuts the file. What opens is verified, and drawn in one of three ways.
#include "fuzz.h"

#include "scene/clouds/cloud.h"
#include "scene/clouds/fingerprint.h"

enum {
    SECTION = 1 << 16,
    INFO = 96, // bytes of the header before what a cloud tells
    CHECK = INFO + offsetof(patina_cloud_info, packed) + 8 * PT_ARRAYS,
    TAIL = CHECK + 8, // page_sum, packed_error, packed and unordered, trusts, uncolored
    TAIL_SIZE = 24 + 136
};

static struct {
    patina_device *device;
    patina_frame *frame;
    struct fuzz_file file;
    uint8_t *good, *bytes;
    size_t size;
} fuzz;

// The sum of the header, which is of its first part, of the chunks in the section behind it, and of its tail.
static uint64_t sum_of(const uint8_t *bytes)
{
    uint32_t version, chunks;
    memcpy(&version, bytes + 8, 4);
    memcpy(&chunks, bytes + 20, 4);
    uint64_t sum = pt_fingerprint(version, bytes, CHECK);
    const size_t size = chunks * sizeof(struct pt_chunk);
    sum = pt_fingerprint(sum, bytes + SECTION, size < fuzz.size - SECTION ? size : fuzz.size - SECTION);
    return pt_fingerprint(sum, bytes + TAIL, TAIL_SIZE);
}

static void edit(uint8_t *at, size_t room, uint8_t value, uint8_t how)
{
    static const uint64_t numbers[] = {0, ~0ull, 1ull << 63, (1ull << 63) - 1, 1ull << 32, (1ull << 32) - 1, 1ull << 31, 1};
    static const float floats[] = {0, -1, 3e38f, 1e-40f};
    const size_t wide = how & 2 ? 8 : 4;
    uint64_t word = 0;
    if (how % 8 < 4 || room < 8) {
        *at = how & 1 ? value : (uint8_t)(*at ^ value);
        return;
    }
    memcpy(&word, at, wide);
    if (value < 8)
        word = numbers[value];
    else if (value < 16 && wide == 4)
        memcpy(&word, floats + value % 4, 4);
    else if (value < 20)
        word = value & 1 ? 0x7FC000007FC00000ull : 0x7F8000007F800000ull; // two float NaN or infinities
    else if (value < 24)
        word = value & 1 ? 0x7FF8000000000000ull : 0x7FF0000000000000ull; // of double
    else
        word += (uint64_t)(int64_t)(int8_t)value;
    memcpy(at, &word, wide);
}

static void set_up(void)
{
    patina_cloud *cloud = fuzz_cloud(1);
    char path[] = "/tmp/patina-fuzz-XXXXXX";
    int descriptor = mkstemp(path);
    fuzz.file = fuzz_file();
    fuzz.device = fuzz_device();
    REQUIRE(descriptor >= 0 && patina_frame_create(fuzz.device, &fuzz.frame) == PATINA_OK &&
            patina_cloud_save(cloud, path) == PATINA_OK);
    FILE *file = fopen(path, "rb");
    REQUIRE(file && !fseek(file, 0, SEEK_END));
    fuzz.size = (size_t)ftell(file);
    fuzz.good = malloc(fuzz.size);
    fuzz.bytes = malloc(fuzz.size);
    REQUIRE(fuzz.good && fuzz.bytes && !fseek(file, 0, SEEK_SET) && fread(fuzz.good, fuzz.size, 1, file) == 1);
    fclose(file);
    close(descriptor);
    unlink(path);
    patina_cloud_destroy(cloud);
    uint64_t check;
    memcpy(&check, fuzz.good + CHECK, 8);
    REQUIRE(sum_of(fuzz.good) == check); // the layout is as it is said here
}

static void draw(patina_cloud *cloud, size_t way)
{
    float ramp[6] = {0, 0, 0, 1, 1, 1};
    patina_cloud_style style = {.struct_size = sizeof style,
                                .hidden_classes = {way == 2},
                                .transparency = way == 1 ? 0.5f : 0,
                                .ramp = ramp,
                                .ramp_count = 2,
                                .color_source = way == 2 ? PATINA_COLOR_SCALAR : 0};
    patina_scene *scene = fuzz_scene(cloud, &style, way == 2 ? PATINA_SURFACE_SPLATS : 0);
    patina_frame_render(fuzz.frame, scene); // an error is an answer, too
    patina_scene_destroy(scene);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char message[512];
    if (!fuzz.device)
        set_up();
    size_t length = fuzz.size;
    memcpy(fuzz.bytes, fuzz.good, length);
    for (size_t i = 0; i + 5 <= size && i < 5 * 64; i += 5) {
        size_t at = (data[i] % 16) * (size_t)SECTION + (((size_t)data[i + 1] | (size_t)data[i + 2] << 8) & (SECTION - 1));
        if (data[i] >= 128) // most numbers lie at the beginning of a section, at multiples of 4
            at = at % SECTION % 512 / 4 * 4 + at / SECTION * SECTION;
        if (at < length)
            edit(fuzz.bytes + at, length - at, data[i + 3], data[i + 4]);
    }
    if (size % 3) {
        const uint64_t check = sum_of(fuzz.bytes);
        memcpy(fuzz.bytes + CHECK, &check, 8);
    }
    if (size % 5 == 1)
        length = length * data[size - 1] / 256;
    fuzz_fill(&fuzz.file, fuzz.bytes, length);
    patina_cloud *cloud = NULL;
    if (patina_cloud_open(fuzz.file.path, &cloud) != PATINA_OK) {
        REQUIRE(!cloud && patina_message(NULL, message, sizeof message) > 0);
        return 0;
    }
    patina_cloud_info info = {.struct_size = sizeof info};
    REQUIRE(patina_cloud_get_info(cloud, &info) == PATINA_OK);
    REQUIRE(size % 3 || info.count == FUZZ_POINTS); // damage; else a forgery
    if (info.count > 1u << 20) {                    // more points than the file has: what is asked of it says so
        patina_cloud_destroy(cloud);
        return 0;
    }
    patina_cloud_verify(fuzz.file.path, NULL);
    draw(cloud, size % 3);
    patina_cloud_destroy(cloud);
    return 0;
}
