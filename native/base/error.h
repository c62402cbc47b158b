// SPDX-License-Identifier: GPL-3.0-or-later
// Errors live on handles; the thread keeps a copy of the last one for calls that return no handle.
#ifndef PT_ERROR_H
#define PT_ERROR_H

#include "patina/patina.h"
#include "platform.h"

#include <stdarg.h>

// First member of every handle: patina_message() takes any of them.
struct pt_handle {
    uint32_t magic; // PT_MAGIC while alive
    struct pt_mutex lock;
    char message[512];
};

enum { PT_MAGIC = 0x50a7104a };

void pt_handle_init(struct pt_handle *handle);
void pt_handle_destroy(struct pt_handle *handle);

// Stores the message at the handle (may be NULL) and at the thread, logs it, returns code.
int pt_fail(const struct pt_handle *handle, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));
// Copies the thread's last message to the handle, for errors raised by code that has no handle. Returns code.
int pt_fail_again(const struct pt_handle *handle, int code);

enum pt_level { PT_LOG_ERROR = 0, PT_LOG_WARNING = 1, PT_LOG_INFO = 2 };
void pt_log(enum pt_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));
void pt_log_write(enum pt_level level, const char *text);

#endif
