// SPDX-License-Identifier: GPL-3.0-or-later
// patina: looks at, renders and converts point clouds without Blender.
#include "tool.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- messages ----------------------------------------------------------------------------------------------------

// Replaces what would command a terminal, or turn the order of what is read: control characters, and UTF-8's marks of direction.
static void clean(char *text)
{
    for (unsigned char *at = (unsigned char *)text; *at; at++) {
        const int control = *at < 0x20 || *at == 0x7F,
                  upper = (at[0] == 0xC2 && at[1] >= 0x80 && at[1] < 0xA0) || (at[0] == 0xD8 && at[1] == 0x9C);
        const int mark = at[0] == 0xE2 &&
                         ((at[1] == 0x80 && ((at[2] >= 0xAA && at[2] <= 0xAE) || at[2] == 0x8E || at[2] == 0x8F)) ||
                          (at[1] == 0x81 && at[2] >= 0xA6 && at[2] <= 0xA9));
        memset(at, '?', control ? 1 : upper ? 2 : mark ? 3 : 0);
    }
}

static void print_clean(FILE *out, const char *format, va_list list)
{
    char line[4096];
    vsnprintf(line, sizeof line, format, list);
    clean(line);
    fputs(line, out);
}

static char within[320]; // empty: nothing

void tool_say_within(const char *what)
{
    snprintf(within, sizeof within, "%s", what ? what : "");
    clean(within);
}

static void say(const char *format, va_list list)
{
    fputs("patina: ", stderr);
    if (within[0])
        fprintf(stderr, "%s: ", within);
    print_clean(stderr, format, list);
    fputc('\n', stderr);
}

void tool_print(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    print_clean(stdout, format, list);
    va_end(list);
}

void tool_say(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    say(format, list);
    va_end(list);
}

int tool_misuse(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    say(format, list);
    va_end(list);
    if (!within[0])
        fputs("'patina help' lists commands and options.\n", stderr);
    return TOOL_USAGE;
}

int tool_failed(const char *what, const void *handle, int code)
{
    if (code == PATINA_ERROR_CANCELLED || tool_cancelled()) {
        tool_say("cancelled");
        return TOOL_CANCELLED;
    }
    char message[1024] = "";
    if (!handle || !patina_message(handle, message, sizeof message))
        patina_message(NULL, message, sizeof message);
    const char *sentence = message[0] ? message : patina_error_text(code);
    if (!strncmp(sentence, what, strlen(what))) // it names the file itself
        tool_say("%s", sentence);
    else
        tool_say("%s: %s", what, sentence);
    return TOOL_FAILED;
}

void tool_drain_log(int least)
{
    static const char *const kinds[] = {"error", "warning", "note"};
    char line[1024];
    int level;
    while (patina_log_next(line, sizeof line, &level))
        if (level > 0 && level <= least) // errors reach the user as the message of the call that failed
            tool_say("%s: %s", kinds[level > 2 ? 2 : level], line);
}

// ---- signals -----------------------------------------------------------------------------------------------------

static struct pt_mutex cancel_lock;
static patina_progress *cancel_progress;
static patina_frame *cancel_frame;
static atomic_int cancelled;

static void interrupted(void)
{
    pt_mutex_lock(&cancel_lock);
    if (atomic_exchange(&cancelled, 1) || (!cancel_progress && !cancel_frame))
        _Exit(TOOL_CANCELLED);
    if (cancel_progress)
        patina_progress_cancel(cancel_progress);
    if (cancel_frame)
        patina_frame_cancel(cancel_frame);
    pt_mutex_unlock(&cancel_lock);
}

// Call before any other thread exists: from then on Ctrl-C and SIGTERM cancel what is announced. 0, or an error number.
static int watch_signals(void)
{
    pt_mutex_init(&cancel_lock);
    return pt_watch_interrupts(interrupted);
}

void tool_cancellable(patina_progress *progress, patina_frame *frame)
{
    pt_mutex_lock(&cancel_lock);
    cancel_progress = progress;
    cancel_frame = frame;
    pt_mutex_unlock(&cancel_lock);
}

int tool_cancelled(void) { return atomic_load(&cancelled); }

// ---- options as --NAME=VALUE ---------------------------------------------------------------------------------------

// Writes --NAME=VALUE as two arguments, up to a bare --, and cuts the given text in two for it. out has room for 2 * count pointers.
// Returns how many arguments there are, or -1 after a message.
static int split_values(int count, char **arguments, char **out)
{
    int written = 0, files = 0;
    for (int i = 0; i < count; i++) {
        char *equals = files || strncmp(arguments[i], "--", 2) != 0 ? NULL : strchr(arguments[i], '=');
        files |= !strcmp(arguments[i], "--");
        out[written++] = arguments[i];
        if (!equals)
            continue;
        *equals = 0;
        if (tool_is_switch(arguments[i])) {
            tool_misuse("option '%s' takes no value", arguments[i]);
            return -1;
        }
        out[written++] = equals + 1;
    }
    return written;
}

// ------------------------------------------------------------------------------------------------------------------

int main(int count, char **arguments)
{
    if (pt_program_begin(&count, &arguments)) {
        tool_say("out of memory");
        return TOOL_FAILED;
    }
    if (count < 2) {
        tool_print_usage(stderr);
        return TOOL_USAGE;
    }
    const char *command = arguments[1];
    if (!strcmp(command, "help") || !strcmp(command, "--help") || !strcmp(command, "-h"))
        return tool_help(count - 2, arguments + 2);
    if (!strcmp(command, "version") || !strcmp(command, "--version")) {
        printf("patina %s\n", patina_version());
        return TOOL_OK;
    }
    static const struct {
        const char *name;
        int (*run)(int count, char **arguments);
    } commands[] = {{"render", tool_render},     {"scatter", tool_scatter}, {"merge", tool_merge},
                    {"info", tool_info},         {"convert", tool_convert}, {"analyse", tool_analyse},
                    {"distance", tool_distance}, {"ground", tool_ground},   {"draw", tool_draw_lines}};
    if (watch_signals())
        tool_say("warning: Ctrl-C will end the program without tidying up");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        if (strcmp(command, commands[i].name) != 0)
            continue;
        char **split = calloc(2 * (size_t)count, sizeof *split);
        const int wide = split ? split_values(count - 2, arguments + 2, split) : 0;
        const int result = split && wide >= 0 ? commands[i].run(wide, split) : split ? TOOL_USAGE : TOOL_FAILED;
        if (!split)
            tool_say("out of memory");
        free(split);
        return result;
    }
    return tool_misuse("there is no command '%s'", command);
}
