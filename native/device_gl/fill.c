// SPDX-License-Identifier: GPL-3.0-or-later
#include "device_gl.h"
int pt_gl_fill(struct pt_gl_device *d, const struct fill_args *args, struct pt_buffer *const *buffers,
               const atomic_int *cancel)
{
    (void)args, (void)buffers, (void)cancel;
    return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED, "not yet");
}
