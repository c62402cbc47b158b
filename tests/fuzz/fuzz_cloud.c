// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: a saved cloud that was damaged. The input is a list of edits to a good file, five bytes each: a section
// (64 KiB, as patina_cloud_save lays them out), an offset, a value and a mask of how it is put there. The last byte of an odd list
// cuts the file. What opens is drawn, in one of three ways.
#include "fuzz.h"

enum { SECTION = 1 << 16 };

static struct {
    patina_device *device;
    patina_frame *frame;
    struct fuzz_file file;
    uint8_t *good, *bytes;
    size_t size;
} fuzz;

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
        if (at < length)
            fuzz.bytes[at] = data[i + 4] & 1 ? data[i + 3] : (uint8_t)(fuzz.bytes[at] ^ data[i + 3]);
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
    REQUIRE(patina_cloud_get_info(cloud, &info) == PATINA_OK && info.count == FUZZ_POINTS);
    draw(cloud, size % 3);
    patina_cloud_destroy(cloud);
    return 0;
}
