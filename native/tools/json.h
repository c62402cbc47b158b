// SPDX-License-Identifier: GPL-3.0-or-later
// JSON (RFC 8259) as a tree. It reads the jobs of `patina draw --batch`.
#ifndef TOOL_JSON_H
#define TOOL_JSON_H

#include <stdint.h>

enum json_kind { JSON_NULL, JSON_FALSE, JSON_TRUE, JSON_NUMBER, JSON_TEXT, JSON_LIST, JSON_OBJECT };

struct json {
    enum json_kind kind;
    const char *key;  // in an object; NULL elsewhere
    const char *text; // of a text, in UTF-8; of a number, as the file has it; NULL: of others
    uint32_t line;    // that it begins in, from 1 on
    uint32_t count;   // values in a list or an object
    const struct json *first, *next;
};

struct json_file {
    const struct json *root;
    char *text; // owns the keys and texts
    struct json *values;
};

// Reads a whole file. 0, or -1 after a message that names the line. json_free it in any case.
int json_read(const char *path, struct json_file *file);
void json_free(struct json_file *file);
// "a number", for messages.
const char *json_kind_name(enum json_kind kind);

#endif
