// SPDX-License-Identifier: GPL-3.0-or-later
// What tests of the readers share: files in memory, and what they must hold or be refused with. Behind cmocka.h.
#ifndef PT_TEST_FILES_H
#define PT_TEST_FILES_H

#include <patina/patina.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define ASCII "ply\nformat ascii 1.0\n"
#define LITTLE "ply\nformat binary_little_endian 1.0\n"
#define BIG "ply\nformat binary_big_endian 1.0\n"

static inline patina_file *open_bytes(const void *data, size_t size)
{
    patina_file *file = NULL;
    char message[512] = "";
    if (patina_file_open_memory(data, size, &file) != PATINA_OK) {
        patina_message(NULL, message, sizeof message);
        fail_msg("%s", message);
    }
    return file;
}

static inline patina_file *open_text(const char *text) { return open_bytes(text, strlen(text)); }

static inline patina_file_info info_of(const patina_file *file)
{
    patina_file_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_file_get_info(file, &info), PATINA_OK);
    return info;
}

// The file must be refused with this code and a message that holds these words.
static inline void refuse_bytes(const void *data, size_t size, int code, const char *words)
{
    patina_file *file = (patina_file *)8;
    char message[512] = "";
    int got = patina_file_open_memory(data, size, &file);
    patina_message(NULL, message, sizeof message);
    if (got != code || file || !strstr(message, words))
        fail_msg("wanted %d '%s', got %d '%s'", code, words, got, message);
}

static inline void refuse(const char *text, const char *words) { refuse_bytes(text, strlen(text), PATINA_ERROR_FORMAT, words); }

static inline void expect_positions(const patina_file *file, const float *wanted, size_t values)
{
    float xyz[64];
    assert_true(values <= 64 && info_of(file).count * 3 == values);
    assert_int_equal(patina_file_read_positions(file, xyz, values * sizeof *xyz), PATINA_OK);
    for (size_t i = 0; i < values; i++)
        if (!(xyz[i] == wanted[i]) && !(isnan(xyz[i]) && isnan(wanted[i])))
            fail_msg("value %zu is %.9g, wanted %.9g", i, (double)xyz[i], (double)wanted[i]);
}

static inline void expect_one(const char *text, float x, float y, float z)
{
    patina_file *file = open_text(text);
    expect_positions(file, (float[]){x, y, z}, 3);
    patina_file_destroy(file);
}

static inline void expect_bytes(const patina_file *file, const uint8_t *wanted, size_t values)
{
    uint8_t rgba[64];
    assert_int_equal(patina_file_read_colors_u8(file, rgba, sizeof rgba), PATINA_OK);
    assert_memory_equal(rgba, wanted, values);
}

// A header and a body that may hold zeros.
struct blob {
    uint8_t bytes[1024];
    size_t size;
};

static inline struct blob blob(const char *header, const void *body, size_t size)
{
    struct blob b;
    b.size = strlen(header) + size;
    assert_true(b.size <= sizeof b.bytes);
    memcpy(b.bytes, header, strlen(header));
    memcpy(b.bytes + strlen(header), body, size);
    return b;
}

// The log is emptied before a call; behind it a line must hold these words, or there must be none (NULL).
static inline void empty_log(void)
{
    while (patina_log_next(NULL, 0, NULL))
        ;
}

static inline void expect_log(const char *words)
{
    char line[512], all[2048] = "";
    int level;
    while (patina_log_next(line, sizeof line, &level))
        snprintf(all + strlen(all), sizeof all - strlen(all), "%d %s\n", level, line);
    if (words ? !strstr(all, words) : *all)
        fail_msg("the log should hold '%s', not '%s'", words ? words : "nothing", all);
}

#endif
