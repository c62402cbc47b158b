// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a .conf in a folder with two scans, one.ply and two.ptx; and as its second line.
#include "fuzz.h"

#include <sys/stat.h>

static char folder[] = "/tmp/patina-fuzz-conf-XXXXXX";

static void put(const char *name, const void *data, size_t size)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    REQUIRE(file && fwrite(data, 1, size, file) == size && !fclose(file));
}

static void clear(void)
{
    static const char *const names[] = {"one.ply", "two.ptx", "a.conf"};
    char path[128];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    rmdir(folder);
}

static void make_folder(void)
{
    static const char ply[] =
        "ply\nformat ascii 1.0\nobj_info num_cols 2\nobj_info num_rows 2\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element range_grid 4\nproperty list uchar int v\nend_header\n0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n"
        "1 0\n1 1\n1 2\n0\n";
    static const char ptx[] = "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1\n1 2 3 0.5\n1 3 3 0.5\n";
    REQUIRE(mkdtemp(folder));
    atexit(clear);
    put("one.ply", ply, sizeof ply - 1);
    put("two.ptx", ptx, sizeof ptx - 1);
}

static void open_conf(const uint8_t *data, size_t size)
{
    char path[128], message[512];
    patina_file *file = NULL;
    put("a.conf", data, size);
    snprintf(path, sizeof path, "%s/a.conf", folder);
    if (patina_file_open(path, NULL, &file)) {
        REQUIRE(!file && patina_message(NULL, message, sizeof message) > 0);
        return;
    }
    patina_file_info info = {.struct_size = sizeof info};
    REQUIRE(patina_file_get_info(file, &info) == PATINA_OK);
    uint64_t next = 0;
    for (uint32_t i = 0; i < info.scans; i++) {
        patina_file_scan scan = {.struct_size = sizeof scan};
        REQUIRE(patina_file_get_scan(file, i, &scan) == PATINA_OK && scan.first == next);
        next += scan.count;
    }
    REQUIRE(!info.scans || next == info.count);
    fuzz_read_columns(file, &info);
    patina_file_destroy(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char before[] = "bmesh one.ply 1 2 3 0 0 0.6 0.8\nbmesh two.ptx ";
    static int made;
    if (!made++)
        make_folder();
    for (size_t i = 0; i < size; i++)
        if (data[i] == '/')
            return 0; // of this folder alone
    open_conf(data, size);
    uint8_t *text = malloc(size + sizeof before);
    REQUIRE(text);
    memcpy(text, before, sizeof before - 1);
    memcpy(text + sizeof before - 1, data, size);
    open_conf(text, size + sizeof before - 1);
    free(text);
    return 0;
}
