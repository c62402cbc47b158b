// SPDX-License-Identifier: GPL-3.0-or-later
#include "error.h"

#include <stdio.h>
#include <string.h>

static _Thread_local char thread_message[512];

void pt_handle_init(struct pt_handle *handle)
{
    handle->magic = PT_MAGIC;
    pt_mutex_init(&handle->lock);
    handle->message[0] = 0;
}

void pt_handle_destroy(struct pt_handle *handle)
{
    handle->magic = 0;
    pt_mutex_destroy(&handle->lock);
}

static void store(const struct pt_handle *handle)
{
    if (!handle)
        return;
    struct pt_handle *h = (struct pt_handle *)handle; // the message is not part of a handle's value
    pt_mutex_lock(&h->lock);
    memcpy(h->message, thread_message, sizeof h->message);
    pt_mutex_unlock(&h->lock);
}

int pt_fail(const struct pt_handle *handle, int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(thread_message, sizeof thread_message, format, args);
    va_end(args);
    store(handle);
    if (code != PATINA_ERROR_CANCELLED)
        pt_log_write(PT_LOG_ERROR, thread_message);
    return code;
}

int pt_fail_again(const struct pt_handle *handle, int code)
{
    store(handle);
    return code;
}

const char *patina_error_text(int code)
{
    switch (code) {
    case PATINA_OK: return "no error";
#define PATINA_X(name, number, text)                                                                                           \
    case PATINA_##name: return text;
        PATINA_ERRORS(PATINA_X)
#undef PATINA_X
    }
    return "unknown error code";
}

size_t patina_message(const void *handle, char *buffer, size_t size)
{
    char copy[512];
    if (handle) {
        struct pt_handle *h = (struct pt_handle *)handle;
        if (h->magic != PT_MAGIC)
            return 0;
        pt_mutex_lock(&h->lock);
        memcpy(copy, h->message, sizeof copy);
        pt_mutex_unlock(&h->lock);
    } else {
        memcpy(copy, thread_message, sizeof copy);
    }
    if (buffer && size)
        snprintf(buffer, size, "%s", copy);
    return strlen(copy);
}
