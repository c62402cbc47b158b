// SPDX-License-Identifier: GPL-3.0-or-later
// Stands in for the whole folder in a build without OpenGL.
#include "device.h"

int pt_device_gl_create(const patina_device_desc *desc, const char *context, struct patina_device **out)
{
    (void)desc, (void)context;
    *out = NULL;
#if defined(__APPLE__)
    return pt_fail(NULL, PATINA_ERROR_UNSUPPORTED,
                   "OpenGL ends at 4.1 on macOS, and Patina needs 4.3: it computes on the processor");
#else
    return pt_fail(NULL, PATINA_ERROR_UNSUPPORTED, "this build has no OpenGL");
#endif
}
