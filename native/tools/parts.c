// SPDX-License-Identifier: GPL-3.0-or-later
// patina merge: of tiles, or of the keys of a cloud's parts. The options of a picture stand in its files: what is merged asks for no
// others.
#include "tool.h"

#include <stdlib.h>
#include <string.h>

// ---- options as text: "LENGTH:TEXT," each -------------------------------------------------------------------------------

// How many arguments from `at` on say nothing of what the picture is: where it goes, which part or tile it is, and who draws it.
static int apart_from_picture(char **at, int left)
{
    static const char *const names[] = {"-o",        "--output", "--part", "--behind",  "--tile",  "--tiles", "--device",
                                        "--threads", "--batch",  "--next", "--verbose", "--strip", "--memory"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(*at, names[i]))
            return strcmp(*at, "--verbose") && left > 1 ? 2 : 1;
    return 0;
}

char *tool_options_text(int count, char **arguments)
{
    size_t size = 1;
    for (int i = 0; i < count; i++)
        size += strlen(arguments[i]) + 24;
    char *text = malloc(size), *end = text;
    if (!text)
        return NULL;
    *end = 0;
    for (int i = 0; i < count;) {
        const int apart = apart_from_picture(arguments + i, count - i);
        if (!apart)
            end += snprintf(end, size - (size_t)(end - text), "%zu:%s,", strlen(arguments[i]), arguments[i]);
        i += apart ? apart : 1;
    }
    return text;
}

// Cuts the text into arguments; they lie in it. -1: it is none of ours.
static int cut_text(char *text, char **out, int room)
{
    int count = 0;
    while (*text) {
        char *colon;
        const unsigned long length = strtoul(text, &colon, 10);
        if (*colon != ':' || count == room || strlen(colon + 1) < length + 1 || colon[1 + length] != ',')
            return -1;
        out[count++] = colon + 1;
        colon[1 + length] = 0;
        text = colon + 2 + length;
    }
    return count;
}

uint64_t tool_digest(const char *text) // FNV-1a
{
    uint64_t hash = 0xCBF29CE484222325ull;
    for (; *text; text++)
        hash = (hash ^ (unsigned char)*text) * 0x100000001B3ull;
    return hash;
}

// ---- merging ---------------------------------------------------------------------------------------------------------

struct merge {
    char **files; // into the arguments
    int count;
    char **more; // options that go to the picture, and how many
    int more_count;
    const char *output, *next;
};

static int parse(int count, char **arguments, struct merge *merge)
{
    merge->files = arguments;
    merge->more = calloc((size_t)count + 1, sizeof *merge->more);
    if (!merge->more)
        return tool_failed("merge", NULL, PATINA_ERROR_MEMORY);
    for (int i = 0; i < count; i++) {
        char *name = arguments[i];
        if (name[0] != '-' || !name[1]) {
            merge->files[merge->count++] = name;
            continue;
        }
        if (!strcmp(name, "--verbose")) {
            merge->more[merge->more_count++] = name;
            continue;
        }
        if (i + 1 == count)
            return tool_misuse("option '%s' lacks its value", name);
        char *value = arguments[++i];
        if (!strcmp(name, "-o") || !strcmp(name, "--output"))
            merge->output = value;
        else if (!strcmp(name, "--next"))
            merge->next = value;
        else if (!strcmp(name, "--device") || !strcmp(name, "--threads") || !strcmp(name, "--memory")) {
            merge->more[merge->more_count++] = name;
            merge->more[merge->more_count++] = value;
        } else
            return tool_misuse("merge: there is no option '%s'", name);
    }
    if (!merge->count || !merge->output || !*merge->output)
        return tool_misuse("merge: files of tiles or of keys, and -o OUT.png, please");
    return TOOL_OK;
}

// Draws the picture that the first file's options describe.
static int merge_keys(struct merge *merge)
{
    enum { MOST = 1 << 16 };
    patina_keys_info info = {.struct_size = sizeof info};
    int code = patina_keys_get_info(merge->files[0], &info);
    char *note = code ? NULL : malloc(info.note_size + 1);
    char **arguments = calloc(MOST, sizeof *arguments);
    if (!code)
        code = note && arguments ? patina_keys_read_note(merge->files[0], note, info.note_size + 1) : PATINA_ERROR_MEMORY;
    int result = code ? tool_failed(merge->files[0], NULL, code) : TOOL_OK;
    if (!result && info.kind != PATINA_KEYS_PART) {
        tool_say("'%s' is what a round is told, no keys of a part", merge->files[0]);
        result = TOOL_FAILED;
    }
    int count = result ? 0 : cut_text(note, arguments, MOST - 8 - merge->more_count);
    if (!result && count <= 0) {
        tool_say("'%s' does not tell the options of its picture: patina scatter writes them", merge->files[0]);
        result = TOOL_FAILED;
    }
    if (!result) {
        memmove(arguments + merge->more_count + 2, arguments, (size_t)count * sizeof *arguments);
        memcpy(arguments, merge->more, (size_t)merge->more_count * sizeof *arguments);
        arguments[merge->more_count] = "-o";
        arguments[merge->more_count + 1] = (char *)merge->output;
        result = tool_draw(
            count + merge->more_count + 2, arguments,
            &(struct tool_parts){.keys = (const char *const *)merge->files, .count = merge->count, .next = merge->next});
    }
    free(arguments);
    free(note);
    return result;
}

int tool_merge(int count, char **arguments)
{
    struct merge merge = {0};
    int result = parse(count, arguments, &merge);
    if (!result)
        result = tool_begins(merge.files[0], "patkeys", 7) ? merge_keys(&merge)
                                                           : tool_merge_tiles(merge.count, merge.files, merge.output);
    free(merge.more);
    return result;
}

int tool_scatter(int count, char **arguments) { return tool_draw(count, arguments, &(struct tool_parts){.scatter = 1}); }
