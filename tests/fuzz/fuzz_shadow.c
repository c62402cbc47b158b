// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a file of shadow textures; behind an E, edits to a file that was just baked: offset (two bytes)
// and value, and a last byte that cuts it. Each as it is, and with a check sum that is right, so that what lies behind it is
// reached. What loads is drawn.
#include "fuzz.h"

#include "scene/clouds/fingerprint.h"

#include <fcntl.h>
#include <stdbool.h>

enum { VERSION = 3, CHECKSUM = 24, BODY = 32 }; // of native/run/frame_shadow_file.c

static struct {
    patina_device *device;
    patina_scene *scene;
    struct fuzz_file file;
    uint8_t *good; // baked
    size_t size;
} fuzz;

static int load(const uint8_t *data, size_t size)
{
    patina_frame *frame = NULL;
    char message[512];
    fuzz_fill(&fuzz.file, data, size);
    REQUIRE(patina_frame_create(fuzz.device, &frame) == PATINA_OK);
    int good = patina_frame_load_shadows(frame, fuzz.scene, fuzz.file.path) == PATINA_OK;
    if (good)
        REQUIRE(patina_frame_render(frame, fuzz.scene) == PATINA_OK);
    else
        REQUIRE(patina_message(frame, message, sizeof message) > 0);
    patina_frame_destroy(frame);
    return good;
}

static void set_up(void)
{
    fuzz.file = fuzz_file();
    fuzz.device = fuzz_device();
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    fuzz.scene = fuzz_scene(fuzz_cloud(0), &style, 0);
    patina_frame *frame = NULL;
    char path[] = "/tmp/patina-fuzz-XXXXXX";
    int descriptor = mkstemp(path);
    REQUIRE(descriptor >= 0 && patina_frame_create(fuzz.device, &frame) == PATINA_OK &&
            patina_frame_bake_shadows(frame, fuzz.scene) == PATINA_OK && patina_frame_save_shadows(frame, path) == PATINA_OK);
    close(descriptor); // of what the saved file took the place of
    descriptor = open(path, O_RDONLY);
    REQUIRE(descriptor >= 0);
    fuzz.size = (size_t)lseek(descriptor, 0, SEEK_END);
    fuzz.good = malloc(fuzz.size);
    REQUIRE(fuzz.size > BODY + FUZZ_POINTS && fuzz.good && pread(descriptor, fuzz.good, fuzz.size, 0) == (ssize_t)fuzz.size);
    close(descriptor);
    unlink(path);
    patina_frame_destroy(frame);
    REQUIRE(load(fuzz.good, fuzz.size));
}

static void load_both(uint8_t *bytes, size_t size)
{
    load(bytes, size);
    if (size < BODY)
        return;
    uint64_t checksum = pt_fingerprint(VERSION, bytes + BODY, size - BODY);
    memcpy(bytes + CHECKSUM, &checksum, sizeof checksum);
    load(bytes, size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!fuzz.device)
        set_up();
    bool edits = size && *data == 'E';
    size_t length = edits ? fuzz.size : size;
    uint8_t *bytes = malloc(length + 1);
    REQUIRE(bytes);
    if (length)
        memcpy(bytes, edits ? fuzz.good : data, length);
    for (size_t i = 1; edits && i + 3 <= size; i += 3)
        bytes[(data[i] | (size_t)data[i + 1] << 8) % length] = data[i + 2];
    if (edits && size % 3 == 2)
        length = length * data[size - 1] / 256;
    load_both(bytes, length);
    free(bytes);
    return 0;
}
