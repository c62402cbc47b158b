// SPDX-License-Identifier: GPL-3.0-or-later
#include "descriptor.h"

#include <string.h>

enum { MOST = 1 << 16 }; // bytes; a greater struct_size was never set

static int check_size(const struct pt_handle *handle, const char *call, size_t size)
{
    // A structure ends with its alignment: what does not is no structure's size, and would end within a field, half an address.
    if (size > sizeof size && size <= MOST && size % sizeof size == 0)
        return PATINA_OK;
    return pt_fail(handle, PATINA_ERROR_ARGUMENT, "%s: a descriptor's struct_size is %zu, it was not set to its size", call,
                   size);
}

int pt_take(const struct pt_handle *handle, const char *call, const void *given, void *ours, size_t size)
{
    size_t has = size;
    memset(ours, 0, size);
    if (given) {
        memcpy(&has, given, sizeof has);
        const int error = check_size(handle, call, has);
        if (error)
            return error;
        memcpy(ours, given, has < size ? has : size);
        for (size_t i = size; i < has; i++)
            if (((const unsigned char *)given)[i])
                return pt_fail(
                    handle, PATINA_ERROR_UNSUPPORTED,
                    "%s: the descriptor of %zu bytes asks for something that this library does not know; it knows %zu", call,
                    has, size);
    }
    memcpy(ours, &size, sizeof size);
    return PATINA_OK;
}

int pt_give(const struct pt_handle *handle, const char *call, const void *ours, size_t size, void *to)
{
    size_t has;
    if (!to)
        return pt_fail(handle, PATINA_ERROR_ARGUMENT, "%s: there is nothing to write to", call);
    memcpy(&has, to, sizeof has);
    const int error = check_size(handle, call, has);
    if (error)
        return error;
    const size_t both = has < size ? has : size;
    memcpy((char *)to + sizeof has, (const char *)ours + sizeof has, both - sizeof has);
    memset((char *)to + both, 0, has - both);
    return PATINA_OK;
}
